"""A queue of planning work, done by one worker process that is started again when it dies."""

from __future__ import annotations

import contextlib
import os
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field

from rbprm_core.errors import Cancelled
from rbprm_core.failures import Cause
from rbprm_core.processes import (
    ChannelClosed,
    PeerHung,
    exit_text,
    readable,
)
from rbprm_core.processes.child import STOP_TIMEOUT
from rbprm_ros.errors import NodeCode, NodeError, PlanningFailed
from rbprm_ros.workers.jobs import (
    Answer,
    Cancellation,
    Done,
    Failed,
    Job,
    Preparation,
    Reported,
    Result,
    RobotChoice,
    Validation,
    Work,
)
from rbprm_ros.workers.process_link import MAX_SILENCE, WorkerProcess

IDLE_PERIOD = 1.0  # seconds between two checks whether an idle process is alive
Report = Callable[[Reported], None]


class WorkerLost(NodeError):
    """The worker process ended, or was ended, in the middle of some work.

    Args:
        how: how it ended, in words.
    """

    def __init__(self, how: str) -> None:
        text = f"the planning process was lost ({how}); a new one serves the next request"
        super().__init__(NodeCode.WORKER_LOST, text, cause=Cause.PROCESS_DIED)


@dataclass(eq=False)
class _Task:
    """Work that waits or is under way; `work` is None once it has ended."""

    work: Work | None
    report: Report
    future: Future[Result] = field(default_factory=Future)
    cancelled: bool = False


class PlanningWorker:
    """A queue of work and the process that does it, one piece after the other.

    One thread of the node's process exchanges messages with the worker process.

    Args:
        robot: robot whose data a process loads when it starts.
        report: called with the progress of preparations, in the thread.
        role: last word of the process's command line, which tells workers apart in `ps`.

    Attributes:
        restarts: number of processes that were lost, at work or idle.
    """

    def __init__(self, robot: RobotChoice, report: Report, role: str = "planning") -> None:
        self.restarts = 0
        self._robot, self._report, self._role = robot, report, role
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._process: WorkerProcess | None = None
        self._wake = os.eventfd(0)  # written to when a task is cancelled or the worker is closed
        self._lock = threading.Lock()  # guards `_running`; never held for long
        self._running: _Task | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._serve, name="planning", daemon=True)
        self._thread.start()

    def prepare(self) -> Future[Result]:
        """Start the process and load or compute the robot's data; the future's result is None."""
        return self._put(_Task(Preparation("preparation", self._robot), self._report))

    @property
    def alive(self) -> bool:
        """Whether the process is running."""
        process = self._process
        return process is not None and process.child.alive

    def submit(self, work: Job | Validation, report: Report) -> Future[Result]:
        """Add work to the end of the queue.

        Args:
            work: a job or a validation.
            report: called with the progress, in another thread.

        Returns:
            A future of the plan, or of the invalid states. It raises `PlanningFailed` with the
            failure that the process reported, `WorkerLost` if the process died, and `Cancelled` if
            this worker was closed.
        """
        return self._put(_Task(work, report))

    def cancel(self, future: Future[Result]) -> None:
        """Stop work: running work fails with the code CANCELLED, waiting work never starts.

        Args:
            future: future of the work.
        """
        if future.cancel():
            return
        with self._lock:
            task = self._running
            if task is None or task.future is not future:
                return
            task.cancelled = True
        os.eventfd_write(self._wake, 1)

    def close(self) -> None:
        """End the process; all work that has not ended raises `Cancelled`."""
        self._closing = True
        process = self._process
        if process is not None:
            process.child.terminate()
        self._tasks.put(None)
        os.eventfd_write(self._wake, 1)
        self._thread.join(2 * STOP_TIMEOUT)
        if self._thread.is_alive() and process is not None:
            process.child.kill()  # it receives none of what the thread is sending
        self._thread.join()
        os.close(self._wake)

    def _put(self, task: _Task) -> Future[Result]:
        if self._closing:  # the thread may have ended and would not answer
            task.future.set_exception(Cancelled("waiting"))
        else:
            # Cancelled work stays in the queue until its turn and must not hold its surfaces there.
            task.future.add_done_callback(lambda _: setattr(task, "work", None))
            self._tasks.put(task)
        return task.future

    def _serve(self) -> None:
        """The thread: do one task after the other."""
        while not self._closing:
            try:
                task = self._tasks.get(timeout=IDLE_PERIOD)
            except queue.Empty:
                self._revive()
                continue
            with self._lock:  # a cancellation finds the task either waiting or running
                begun = task is not None and task.future.set_running_or_notify_cancel()
                self._running = task if begun else None
            if task is not None and begun:
                self._complete(task)
        self._drop_process()
        with contextlib.suppress(queue.Empty):
            while True:
                task = self._tasks.get_nowait()
                if task is not None and task.future.set_running_or_notify_cancel():
                    task.future.set_exception(Cancelled("waiting"))

    def _complete(self, task: _Task) -> None:
        """Do a task and set the result or the exception of its future."""
        work = task.work
        assert work is not None
        try:
            task.future.set_result(self._perform(task, work))
        except PlanningFailed as error:
            task.future.set_exception(error)
        except Exception as error:
            # The process has ended, or would still send an answer that no task waits for.
            how = self._drop_process()
            task.future.set_exception(self._exception(error, how))
            if not isinstance(work, Preparation):  # a process that dies while preparing dies again
                self.prepare()
        finally:
            with self._lock:
                self._running = None

    def _exception(self, error: Exception, how: str) -> Exception:
        """The exception of a task for an error during its work, and how its process ended."""
        if not isinstance(error, ChannelClosed | PeerHung):
            return error
        if self._closing:
            return Cancelled("planning")
        return WorkerLost(str(error) if isinstance(error, PeerHung) else how)

    def _perform(self, task: _Task, work: Work) -> Result:
        """Send a task's work, wait for its answer and return the result.

        Raises:
            PlanningFailed: the process reported a failure.
            ChannelClosed: the process has ended, or the worker is being closed.
            PeerHung: the process is hung.
        """
        process = self._started()
        try:
            process.send(work)
        except ChannelClosed:  # it died while idle and has not received this work
            self._drop_process()
            process = self._started()
            process.send(work)
        cancellation_sent = False
        while True:
            if task.cancelled and not cancellation_sent:
                cancellation_sent = True
                process.send(Cancellation(work.id))
            answer = self._next_answer(process)
            if answer is None or answer.id != work.id:
                continue
            if isinstance(answer, Reported):
                task.report(answer)
            elif isinstance(answer, Failed):
                process.forget_states()
                raise PlanningFailed(answer.error, answer.partial)
            elif isinstance(answer, Done):
                return answer.result

    def _next_answer(self, process: WorkerProcess) -> Answer | None:
        """The next answer of the process; None after a cancellation.

        Raises:
            ChannelClosed: the process has ended, or the worker is being closed.
            PeerHung: the process is hung.
        """
        channel = process.child.channel
        ready = readable([channel, self._wake], MAX_SILENCE)
        if not ready:
            raise PeerHung(f"it was silent for {MAX_SILENCE:g} s")
        if self._wake in ready:
            os.eventfd_read(self._wake)
            if self._closing:
                raise ChannelClosed("closed")
            return None
        answer: Answer = channel.receive()
        return answer

    def _started(self) -> WorkerProcess:
        """The process; a new one where there is none or it has died."""
        if self._process is not None and not self._process.child.alive:
            self._drop_process()
        if self._closing:
            raise ChannelClosed("closed")
        if self._process is None:
            self._process = WorkerProcess(self._role)
        return self._process

    def _revive(self) -> None:
        """Replace a process that died while idle, so that the next job finds its data loaded."""
        if self._process is not None and not self._process.child.alive:
            self._drop_process()
            self.prepare()

    def _drop_process(self) -> str:
        """End the process, if there is one, and reap it; returns how it ended, in words."""
        process, self._process = self._process, None
        if process is None:
            return "it was not running"
        self.restarts += not self._closing
        return exit_text(process.child.end(by_itself=True))
