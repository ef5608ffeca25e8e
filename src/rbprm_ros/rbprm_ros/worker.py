"""Work in a process of its own: started, fed, cancelled, and started again when it dies.

The process is started by `subprocess`, not by `multiprocessing`: this one would run the node's main
module, rclpy included, in the child a second time. One thread here talks to it and serves the
pieces of work one after the other, in the order they came.
"""

from __future__ import annotations

import contextlib
import queue
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection

from rbprm_core.errors import Cancelled
from rbprm_ros.environment import Snapshot
from rbprm_ros.failure import NodeCode, NodeError, PlanningFailed
from rbprm_ros.jobs import (
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
from rbprm_ros.snapshot_change import change_between

COMMAND = (sys.executable, "-P", "-m", "rbprm_ros.worker_process")
IDLE_PERIOD = 1.0  # seconds between looks whether an idle process is still there
STOP_TIMEOUT = 0.5  # seconds for an end by itself, and again for one by SIGTERM
SILENCE = 30.0
"""Seconds without a word after which a busy process is taken for hung, and ended. It reports every
20th of a second; the longest known pause is that of loading the robot's meshes."""

Report = Callable[[Reported], None]


class WorkerDied(NodeError):
    """The planning process ended in the middle of a piece of work."""

    def __init__(self, returncode: int) -> None:
        how = f"killed by signal {-returncode}" if returncode < 0 else f"exit code {returncode}"
        text = f"the planning process died ({how}); a new one serves the next request"
        super().__init__(NodeCode.WORKER_LOST, text)


@dataclass(eq=False)
class _Task:
    """A piece of work that waits or is under way."""

    work: Work
    report: Report
    future: Future[Result] = field(default_factory=Future)
    sent: bool = False
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
        """Processes that were lost."""
        self._robot, self._report, self._role = robot, report, role
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._process: _Process | None = None
        self._lock = threading.Lock()  # of the two below and of sending to the process
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
            the process said, `WorkerDied` if it died, `Cancelled` if this worker was closed.
        """
        return self._put(_Task(work, report))

    def cancel(self, future: Future[Result]) -> None:
        """Stop a job: one under way fails with the code CANCELLED, one that waits never starts."""
        if future.cancel():
            return
        with self._lock, contextlib.suppress(OSError):  # a dead process does nothing any more
            task = self._running
            if task is not None and task.future is future:
                task.cancelled = True
                if task.sent and self._process is not None:
                    self._process.send(Cancellation(task.work.id))

    def close(self) -> None:
        """End the process; all work not done ends as `Cancelled`."""
        self._closing = True
        process = self._process  # without the lock, which is held while a process takes no data
        if process is not None:
            process.popen.terminate()
        self._tasks.put(None)
        self._thread.join()

    def _put(self, task: _Task) -> Future[Result]:
        if self._closing:  # the thread may be gone, and nobody would answer
            task.future.set_exception(Cancelled("waiting"))
        else:
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
        try:
            plan = self._perform(task)
        except (EOFError, OSError):
            returncode = self._drop_process()
            closing = self._closing
            self.restarts += not closing
            task.future.set_exception(Cancelled("planning") if closing else WorkerDied(returncode))
            if not isinstance(
                task.work, Preparation
            ):  # one that dies while it prepares would go on dying
                self.prepare()
        except Exception as error:
            task.future.set_exception(error)
        else:
            task.future.set_result(plan)

    def _perform(self, task: _Task) -> Result:
        """Send a task's work and wait for its answer.

        Raises:
            PlanningFailed: the process says why. EOFError, OSError: it is gone, or hung.
        """
        try:
            process = self._sent(task)
        except OSError:  # it had died while idle, and has not seen this work
            self._drop_process()
            process = self._sent(task)
        try:
            while True:
                if not process.pipe.poll(SILENCE):
                    raise EOFError
                answer = process.pipe.recv()
                if answer.id != task.work.id:
                    continue
                if isinstance(answer, Reported):
                    task.report(answer)
                elif isinstance(answer, Failed):
                    process.forget_states()
                    raise PlanningFailed(answer.failure, answer.partial)
                elif isinstance(answer, Done):
                    return answer.result
        finally:
            with self._lock:
                self._running = None

    def _sent(self, task: _Task) -> _Process:
        """The process, after it was sent a task's work."""
        process = self._started()
        with self._lock:
            process.send(task.work)
            task.sent = True
            if task.cancelled:
                process.send(Cancellation(task.work.id))
        return process

    def _started(self) -> _Process:
        """The process; a new one where there is none, or none any more."""
        if self._process is not None and self._process.popen.poll() is not None:
            self._drop_process()
        with self._lock:
            if self._closing:
                raise EOFError
            if self._process is None:
                self._process = _Process(self._role)
                if self._closing:  # `close` did not see it
                    self._process.popen.terminate()
            return self._process

    def _revive(self) -> None:
        """Replace a process that died while idle, so that the next job finds it warm."""
        if self._process is not None and self._process.popen.poll() is not None:
            self._drop_process()
            self.restarts += 1
            self.prepare()

    def _drop_process(self) -> int:
        """End the process, if there is one, and reap it; returns its exit code."""
        with self._lock:
            process, self._process = self._process, None
        return process.end() if process is not None else 0


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
        self.pipe = Connection(ours.detach())
        self._snapshot, self._key = Snapshot(), ""

    def send(self, message: Work | Cancellation) -> None:
        """Send a message; what the process holds already is left out."""
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
