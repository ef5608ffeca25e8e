"""A portfolio: the same request planned with several seeds at once, in processes of their own.

How long a request takes varies from seed to seed, so the first of several is sooner there than one
alone. The plan found depends on the seed that won and on nothing else: `plan` with that seed gives
it again.

A process is started by `subprocess`, not by `multiprocessing`: that one would run the caller's main
module in the child a second time. Each is in a process group of its own, so that Ctrl-C reaches
this process alone, which then ends the others; and each ends by itself when this one is gone.
"""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait

from rbprm_core.budget import MIN_TIME_LIMIT, Progress
from rbprm_core.errors import (
    Cancelled,
    ErrorCode,
    RbprmError,
    TimeLimitReached,
)
from rbprm_core.planner import Outcome
from rbprm_core.request import PlanRequest
from rbprm_core.robot import RobotDescription
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.validation import finite_number

COMMAND = (sys.executable, "-P", "-m", "rbprm_core.portfolio.process")
MAX_JOBS = 1024
LOOK_PERIOD = 0.05  # seconds between looks for a cancellation
GRACE = 2.0  # seconds past the limit, by which a process must have told that it passed
STOP_TIMEOUT = 0.5  # seconds for an end by SIGTERM


@dataclass(frozen=True, eq=False)
class Task:
    """What a process is to plan; the robot's data it finds in the cache.

    Attributes:
        stride: from a seed that fails before the time is over to the next one.
        search_path: Python's, so that plug-ins found here are found there.
    """

    description: RobotDescription
    request: PlanRequest
    scene: Scene
    time_limit: float
    stride: int
    search_path: tuple[str, ...]


@dataclass(frozen=True)
class Started:
    """A process has loaded everything and plans with a seed; its time runs since the first."""

    seed: int


Answer = Started | Progress | Outcome | RbprmError
Report = Callable[[int, Progress], None]


class ProcessDied(RbprmError):
    """A process of the portfolio ended without an answer."""

    def __init__(self, seed: int, returncode: int) -> None:
        self.seed, self.returncode = seed, returncode
        how = f"killed by signal {-returncode}" if returncode < 0 else f"exit code {returncode}"
        super().__init__(f"the process that planned with seed {seed} died ({how})")


def plan_portfolio(
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    time_limit: float,
    jobs: int,
    report: Report = lambda seed, progress: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[PlanRequest, Outcome]:
    """Plan with the request's seed and those after it at once; the first success wins.

    Where a seed finds no guide or no sequence before the time is over, its process goes on with
    another one.

    Args:
        time_limit: seconds that each process may plan, once it has loaded what it needs.
        jobs: number of processes, and of seeds at once.
        report: told a seed and where its process stands, a few times a second.
        cancelled: asked a few times a second; True ends it.

    Returns:
        The request with the seed that won, and its outcome.

    Raises:
        InvalidInput: jobs or limit out of bounds; what `plan` raises.
        RootUnreachable, NoGuideFound, NoSequenceFound, TimeLimitReached: where no seed succeeds,
            the failure of the one that came farthest.
        ProcessDied: every process died.
        Cancelled: as asked for.
    """
    jobs = int(finite_number("jobs", jobs, low=1, high=MAX_JOBS))
    limit = finite_number("time_limit", time_limit, low=MIN_TIME_LIMIT)
    path, description = tuple(sys.path), data.robot.description
    with contextlib.ExitStack() as stack:
        processes = []
        for seed in range(request.seed, request.seed + jobs):
            own = replace(request, seed=seed)
            processes.append(_Process(Task(description, own, scene, limit, jobs, path)))
            stack.callback(processes[-1].end)
        for process in processes:  # only now: a process listens when it has imported everything
            process.begin()
        return _first(processes, report, cancelled)


def _first(
    processes: list[_Process], report: Report, cancelled: Callable[[], bool]
) -> tuple[PlanRequest, Outcome]:
    """The first success of running processes; else the failure that came farthest."""
    failures: list[RbprmError] = []
    while processes:
        if cancelled():
            raise Cancelled("portfolio")
        ready = wait([process.pipe for process in processes], LOOK_PERIOD)
        for process in list(processes):  # by seed: of two that end at once the lower one wins
            answer = process.answer() if process.pipe in ready else process.overdue()
            if isinstance(answer, Progress):
                report(process.request.seed, answer)
            elif isinstance(answer, Outcome):
                return process.request, answer
            elif isinstance(answer, RbprmError):
                failures.append(answer)
                processes.remove(process)
    raise max(failures, key=how_far)


def how_far(error: RbprmError) -> tuple[float, int]:
    """How far a failed attempt came: share of a guide followed, then by the stage it ended in."""
    if error.states:
        return error.fraction, error.code
    stages = (
        ErrorCode.INTERNAL,
        ErrorCode.CANCELLED,
        ErrorCode.INVALID_INPUT,
        ErrorCode.START_UNREACHABLE,
        ErrorCode.GOAL_UNREACHABLE,
        ErrorCode.NO_GUIDE,
        ErrorCode.TIME_LIMIT,
    )
    return -1.0, stages.index(error.code)


class _Process:
    """A running process, and the pipe to it."""

    def __init__(self, task: Task) -> None:
        self.task, self.request = task, task.request
        self._stage, self._deadline = "robot data", float("inf")
        ours, theirs = socket.socketpair()
        with theirs:
            self._popen = subprocess.Popen(
                [*COMMAND, str(theirs.fileno())], pass_fds=[theirs.fileno()], process_group=0
            )
        self.pipe = Connection(ours.detach())

    def begin(self) -> None:
        """Hand it its task."""
        with contextlib.suppress(OSError):  # it died at once, which `answer` then tells
            self.pipe.send(self.task)

    def answer(self) -> Answer:
        """What it says next; that it died where it says nothing more."""
        try:
            said: Answer = self.pipe.recv()
        except (EOFError, OSError):
            return ProcessDied(self.request.seed, self._popen.wait())
        if isinstance(said, Started):
            self.request = replace(self.request, seed=said.seed)
            self._deadline = min(self._deadline, time.monotonic() + self.task.time_limit + GRACE)
        elif isinstance(said, Progress):
            self._stage = said.stage
        return said

    def overdue(self) -> TimeLimitReached | None:
        """Ends it where it has not ended by itself though its time is over."""
        if time.monotonic() <= self._deadline:
            return None
        self.end()
        return TimeLimitReached(self.task.time_limit, self._stage)

    def end(self) -> None:
        """End the process and reap it; harmless where it has ended."""
        self._popen.terminate()
        try:
            self._popen.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait()
        self.pipe.close()
