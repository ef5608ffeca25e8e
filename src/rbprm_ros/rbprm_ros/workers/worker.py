"""Work in a process of its own: started, fed, cancelled, and started again when it dies.

The process is started by `subprocess`, not by `multiprocessing`: this one would run the node's main
module, rclpy included, in the child a second time. One thread here talks to it and serves the
pieces of work one after the other, in the order they came.
"""

from __future__ import annotations

import contextlib
import os
import queue
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection, wait

from rbprm_core.errors import Cancelled
from rbprm_ros.environment.snapshot_diff import change_between
from rbprm_ros.environment.store import Snapshot
from rbprm_ros.failure import NodeCode, NodeError, PlanningFailed
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

COMMAND = (sys.executable, "-P", "-m", "rbprm_ros.workers.worker_process")
IDLE_PERIOD = 1.0  # seconds between looks whether an idle process is still there
STOP_TIMEOUT = 0.5  # seconds for an end by itself, and again for one by SIGTERM
SILENCE = 30.0
"""Seconds after which a busy process is taken for hung, and ended: it says nothing, or takes
nothing of what is sent. It reports every 20th of a second; the longest known pause is that of
loading the robot's meshes."""

Report = Callable[[Reported], None]


class WorkerLost(NodeError):
    """The planning process ended, or was ended, in the middle of a piece of work.

    Args:
        how: it ended.
    """

    def __init__(self, how: str) -> None:
        text = f"the planning process was lost ({how}); a new one serves the next request"
        super().__init__(NodeCode.WORKER_LOST, text)


class _Hung(OSError):
    """The process is there, and says nothing any more."""


@dataclass(eq=False)
class _Task:
    """A piece of work that waits or is under way; `work` is None once it has ended."""

    work: Work | None
    report: Report
    future: Future[Result] = field(default_factory=Future)
    cancelled: bool = False


class PlanningWorker:
    """A queue of work, and the process that does it.

    Args:
        robot: whose data a process is to hold from its start.
        role: what it is for, as its command line says.
        report: told the progress of preparations, from another thread.
    """

    def __init__(self, robot: RobotChoice, report: Report, role: str = "planning") -> None:
        self.restarts = 0
        """Processes that were lost, whether at work or idle."""
        self._robot, self._report, self._role = robot, report, role
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._process: _Process | None = None
        self._wake = os.eventfd(0)  # written to: a task was cancelled, or all is to end
        self._lock = threading.Lock()  # of the two below; nothing that may take long is done in it
        self._running: _Task | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._serve, name="planning", daemon=True)
        self._thread.start()

    def prepare(self) -> Future[Result]:
        """Start the process and have the robot's data loaded or computed; the result is None."""
        return self._put(_Task(Preparation("preparation", self._robot), self._report))

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        process = self._process
        return process is not None and process.popen.poll() is None

    def submit(self, work: Job | Validation, report: Report) -> Future[Result]:
        """Do a piece of work, after those that came before.

        Args:
            report: told the progress, from another thread.

        Returns:
            The plan to come, or the states that do not hold. It raises `PlanningFailed` with what
            the process said, `WorkerLost` if it died, `Cancelled` if this worker was closed.
        """
        return self._put(_Task(work, report))

    def cancel(self, future: Future[Result]) -> None:
        """Stop a job: one under way fails with the code CANCELLED, one that waits never starts."""
        if future.cancel():
            return
        with self._lock:
            task = self._running
            if task is None or task.future is not future:
                return
            task.cancelled = True
        os.eventfd_write(self._wake, 1)

    def close(self) -> None:
        """End the process; all work not done ends as `Cancelled`."""
        self._closing = True
        process = self._process
        if process is not None:
            process.popen.terminate()
        self._tasks.put(None)
        os.eventfd_write(self._wake, 1)
        self._thread.join(2 * STOP_TIMEOUT)
        if self._thread.is_alive() and process is not None:
            process.popen.kill()  # it takes none of what the thread is sending
        self._thread.join()
        os.close(self._wake)

    def _put(self, task: _Task) -> Future[Result]:
        if self._closing:  # the thread may be gone, and nobody would answer
            task.future.set_exception(Cancelled("waiting"))
        else:
            # One that was cancelled waits for its turn, and is not to hold its surfaces until then.
            task.future.add_done_callback(lambda _: setattr(task, "work", None))
            self._tasks.put(task)
        return task.future

    def _serve(self) -> None:
        """The thread: one task at a time."""
        while not self._closing:
            try:
                task = self._tasks.get(timeout=IDLE_PERIOD)
            except queue.Empty:
                self._revive()
                continue
            with self._lock:  # a cancel finds it either not begun or running
                begun = task is not None and task.future.set_running_or_notify_cancel()
                self._running = task if begun else None
            if task is not None and begun:
                self._settle(task)
        self._drop_process()
        with contextlib.suppress(queue.Empty):
            while True:
                task = self._tasks.get_nowait()
                if task is not None and task.future.set_running_or_notify_cancel():
                    task.future.set_exception(Cancelled("waiting"))

    def _settle(self, task: _Task) -> None:
        """Do a task and fill its future, whatever happens."""
        work = task.work
        assert work is not None
        try:
            task.future.set_result(self._perform(task, work))
        except PlanningFailed as error:
            task.future.set_exception(error)
        except Exception as error:
            # Gone, or with an answer to come that nobody waits for any more.
            how = self._drop_process()
            task.future.set_exception(self._told(error, how))
            if not isinstance(work, Preparation):  # who dies while preparing goes on dying
                self.prepare()
        finally:
            with self._lock:
                self._running = None

    def _told(self, error: Exception, how: str) -> Exception:
        """What is told of an error amid a piece of work, given how the process ended."""
        if not isinstance(error, EOFError | OSError):
            return error
        if self._closing:
            return Cancelled("planning")
        return WorkerLost(str(error) if isinstance(error, _Hung) else how)

    def _perform(self, task: _Task, work: Work) -> Result:
        """Send a task's work and wait for its answer.

        Raises:
            PlanningFailed: the process says why. EOFError, OSError: it is gone, or hung.
        """
        process = self._started()
        try:
            process.send(work)
        except ConnectionError:  # it died while idle, and has not seen this work
            self._drop_process()
            process = self._started()
            process.send(work)
        told = False  # that the task is cancelled
        while True:
            if task.cancelled and not told:
                told = True
                process.send(Cancellation(work.id))
            answer = self._heard(process)
            if answer is None or answer.id != work.id:
                continue
            if isinstance(answer, Reported):
                task.report(answer)
            elif isinstance(answer, Failed):
                process.forget_states()
                raise PlanningFailed(answer.failure, answer.partial)
            elif isinstance(answer, Done):
                return answer.result

    def _heard(self, process: _Process) -> Answer | None:
        """What the process says next; None where something else is to be looked at first.

        Raises:
            EOFError, OSError: it is gone, or hung, or all is to end.
        """
        ready = wait([process.pipe, self._wake], SILENCE)
        if not ready:
            raise _Hung(f"it was silent for {SILENCE:g} s")
        if self._wake in ready:
            os.eventfd_read(self._wake)
            if self._closing:
                raise EOFError
            return None
        return process.pipe.recv()

    def _started(self) -> _Process:
        """The process; a new one where there is none, or none any more."""
        if self._process is not None and self._process.popen.poll() is not None:
            self._drop_process()
        if self._closing:
            raise EOFError
        if self._process is None:
            self._process = _Process(self._role)
        return self._process

    def _revive(self) -> None:
        """Replace a process that died while idle, so that the next job finds it warm."""
        if self._process is not None and self._process.popen.poll() is not None:
            self._drop_process()
            self.prepare()

    def _drop_process(self) -> str:
        """End the process, if there is one, and reap it; returns how it ended."""
        process, self._process = self._process, None
        if process is None:
            return "it was not there"
        self.restarts += not self._closing
        code = process.end()
        return f"killed by signal {-code}" if code < 0 else f"exit code {code}"


class _Process:
    """A running process, the pipe to it, and which environment and which sequence it holds."""

    def __init__(self, role: str) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self.popen = subprocess.Popen(
                [*COMMAND, str(theirs.fileno()), role],
                pass_fds=[theirs.fileno()],
                process_group=0,  # a terminal's Ctrl-C reaches the node alone
            )
        limit = struct.pack("ll", int(SILENCE), 0)  # one that hangs may not hang who sends
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
        self.pipe = Connection(ours.detach())
        self._snapshot, self._key = Snapshot(), ""

    def send(self, message: Work | Cancellation) -> None:
        """Send a message; what the process holds already is left out."""
        try:
            self._send(message)
        except BlockingIOError as error:
            raise _Hung(f"it took nothing for {SILENCE:g} s") from error

    def _send(self, message: Work | Cancellation) -> None:
        if isinstance(message, Job | Validation) and message.snapshot is not None:
            if message.snapshot.version != self._snapshot.version:
                self.pipe.send(change_between(self._snapshot, message.snapshot))
                self._snapshot = message.snapshot
            message = replace(message, snapshot=None)
        if isinstance(message, Validation):
            if message.key == self._key:
                message = replace(message, states=None)
            self._key = message.key
        self.pipe.send(message)

    def forget_states(self) -> None:
        """Send the states with the next validation: the process may not have taken them."""
        self._key = ""

    def end(self) -> int:
        """End the process and reap it; returns its exit code."""
        self.pipe.close()
        for stop in (self.popen.terminate, self.popen.kill):
            with contextlib.suppress(subprocess.TimeoutExpired):
                return self.popen.wait(STOP_TIMEOUT)
            stop()
        return self.popen.wait()
