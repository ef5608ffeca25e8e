"""The planning process: serves the jobs that come over a pipe, one after the other, without ROS.

Started by `PlanningWorker` as `python -m rbprm_ros.worker_process FILE_DESCRIPTOR`. The pipe is its
life: it ends when the node closes it, or is gone.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import time
import traceback
from multiprocessing.connection import Connection

from rbprm_core.budget import Budget, Progress
from rbprm_core.errors import Cancelled, InvalidInput, RbprmError
from rbprm_core.plan import ContactPlan, EnvironmentEntry
from rbprm_core.planner import plan
from rbprm_core.result import contact_plan
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scene import Scene
from rbprm_ros.failure import failure_of
from rbprm_ros.jobs import Cancellation, Done, Failed, Job, Preparation, Reported, Work

REPORT_PERIOD = 0.05  # seconds; the planner tells its progress much more often than anyone looks
LISTEN_PERIOD = 0.01  # seconds between looks for a cancellation


class Server:
    """Holds what is kept from job to job: robots, and the scene of the newest surfaces."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._robots: dict[str, RobotData] = {}
        self._scene: Scene | None = None
        self._environment = EnvironmentEntry()

    def serve(self) -> None:
        """Serve until the pipe closes, which raises `EOFError` or `ConnectionError`."""
        while True:
            message = self._pipe.recv()
            if isinstance(message, Preparation | Job):
                self._pipe.send(self._answer(message))

    def _answer(self, work: Work) -> Done | Failed:
        """Do a piece of work; whatever goes wrong is an answer too."""
        line = Line(self._pipe, work.id)
        try:
            data = self._robot(work.robot, line)
            return Done(work.id, self._plan(work, data, line) if isinstance(work, Job) else None)
        except (EOFError, ConnectionError):  # the node is gone: nobody to answer
            raise
        except RbprmError as error:
            return Failed(work.id, failure_of(error))
        except Exception as error:  # a bug of ours: told, and the next job may still do
            traceback.print_exc()
            return Failed(work.id, failure_of(error))

    def _robot(self, name: str, line: Line) -> RobotData:
        if name not in self._robots:
            started = time.monotonic()

            def report(fraction: float) -> None:
                line.report(Progress("robot data", fraction, 0, time.monotonic() - started))
                if line.cancelled():
                    raise Cancelled("robot data")

            self._robots[name] = load_robot_data(Robot.load(load_description(name)), report)
        return self._robots[name]

    def _plan(self, job: Job, data: RobotData, line: Line) -> ContactPlan:
        if job.snapshot is not None:
            self._scene, self._environment = job.snapshot.scene(), job.snapshot.entry
        if self._scene is None:
            raise InvalidInput("surfaces", [], "the planning process was given none")
        budget = Budget(job.time_limit, line.cancelled, line.report)
        outcome = plan(job.request, data, self._scene, budget)
        return contact_plan(outcome, job.request, data.robot, self._environment)


class Line:
    """The pipe during one piece of work: progress goes out, a cancellation comes in."""

    def __init__(self, pipe: Connection, work_id: str) -> None:
        self._pipe, self._id = pipe, work_id
        self._cancelled = False
        self._stage = ""
        self._next_report = self._next_look = 0.0

    def report(self, progress: Progress) -> None:
        """Tell the node, at most once in a period and a stage."""
        now = time.monotonic()
        if progress.stage == self._stage and now < self._next_report:
            return
        self._stage, self._next_report = progress.stage, now + REPORT_PERIOD
        self._pipe.send(Reported(self._id, progress))

    def cancelled(self) -> bool:
        """Whether the node has asked to stop."""
        now = time.monotonic()
        if now >= self._next_look:
            self._next_look = now + LISTEN_PERIOD
            while self._pipe.poll():
                message = self._pipe.recv()
                if isinstance(message, Cancellation) and message.id == self._id:
                    self._cancelled = True
        return self._cancelled


def main() -> None:
    """Serve the pipe whose file descriptor is the argument."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the node, which then ends us
    with contextlib.suppress(EOFError, ConnectionError):
        Server(Connection(int(sys.argv[1]))).serve()


if __name__ == "__main__":
    main()
