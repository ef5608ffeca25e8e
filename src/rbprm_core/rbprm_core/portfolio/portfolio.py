"""A portfolio: the same request planned with several seeds at once, each in a process of its own.

The planning time varies from seed to seed, so that the first of several plans comes sooner than the
plan of one seed. The plan depends on the winning seed and on nothing else: `plan` with that seed
gives it again.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from rbprm_core.budget import MIN_TIME_LIMIT, Progress
from rbprm_core.errors import (
    Cancelled,
    ErrorCode,
    RbprmError,
    TimeLimitReached,
)
from rbprm_core.failures import Cause, Failure
from rbprm_core.outcome import Outcome
from rbprm_core.processes import (
    ChannelClosed,
    ChildProcess,
    exit_text,
    module_command,
    readable,
)
from rbprm_core.request import PlanRequest
from rbprm_core.robot import RobotDescription
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.validation import finite_number

COMMAND = module_command("rbprm_core.portfolio.process")
MAX_JOBS = 1024
POLL_PERIOD = 0.05  # seconds between two checks for a cancellation
GRACE = 2.0  # seconds past its time limit after which a process that has not ended is ended


@dataclass(frozen=True, eq=False)
class Task:
    """The work of one process, which reads the robot's data from the cache.

    Attributes:
        description: the robot.
        request: what to plan, with the first seed of the process.
        scene: surfaces and obstacles.
        time_limit: planning time, seconds.
        stride: difference between a seed that fails before the time limit and the next seed.
        search_path: `sys.path` of the parent, so that the child finds the same plug-ins.
    """

    description: RobotDescription
    request: PlanRequest
    scene: Scene
    time_limit: float
    stride: int
    search_path: tuple[str, ...]


@dataclass(frozen=True)
class Started:
    """A process has loaded its data and begins to plan; its time limit runs from the first seed.

    Attributes:
        seed: seed that it plans with.
    """

    seed: int


Answer = Started | Progress | Outcome | RbprmError
Report = Callable[[int, Progress], None]


class ProcessDied(RbprmError):
    """A process of the portfolio ended without an answer.

    Attributes:
        seed: seed that it planned with.
        returncode: exit code, -n where signal n killed it.
    """

    def __init__(self, seed: int, returncode: int) -> None:
        self.seed, self.returncode = seed, returncode
        self.failure = Failure.of(Cause.PROCESS_DIED)
        super().__init__(
            f"the process that planned with seed {seed} died ({exit_text(returncode)})"
        )


def plan_portfolio(
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    time_limit: float,
    jobs: int,
    report: Report = lambda seed, progress: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[PlanRequest, Outcome]:
    """Plan with the request's seed and the seeds after it at once; the first success wins.

    Where a seed finds no guide or no sequence before the time limit, its process goes on with
    another seed.

    Args:
        request: what to plan; its seed is the first one.
        data: the robot's data.
        scene: surfaces and obstacles.
        time_limit: seconds that each process may plan, once it has loaded its data.
        jobs: number of processes, and of seeds at once.
        report: called with a seed and the progress of its process, a few times a second.
        cancelled: polled a few times a second; True ends the portfolio.

    Returns:
        The request with the winning seed, and its outcome.

    Raises:
        InvalidInput: `jobs` or `time_limit` out of range; what `plan` raises.
        RootUnreachable, NoGuideFound, NoSequenceFound, TimeLimitReached: no seed succeeded; this is
            the failure of the seed that came farthest.
        ProcessDied: every process died.
        Cancelled: `cancelled` returned True.
    """
    jobs = int(finite_number("jobs", jobs, low=1, high=MAX_JOBS))
    limit = finite_number("time_limit", time_limit, low=MIN_TIME_LIMIT)
    path, description = tuple(sys.path), data.robot.description
    with contextlib.ExitStack() as stack:
        processes = []
        for seed in range(request.seed, request.seed + jobs):
            own = replace(request, seed=seed)
            processes.append(_SeedProcess(Task(description, own, scene, limit, jobs, path)))
            stack.callback(processes[-1].end)
        for process in processes:  # only now: a process receives when it has imported everything
            process.begin()
        return _first(processes, report, cancelled)


def _first(
    processes: list[_SeedProcess], report: Report, cancelled: Callable[[], bool]
) -> tuple[PlanRequest, Outcome]:
    """The first success of running processes; else the failure that came farthest is raised."""
    failures: list[RbprmError] = []
    while processes:
        if cancelled():
            raise Cancelled("portfolio")
        ready = readable([process.channel for process in processes], POLL_PERIOD)
        for process in list(processes):  # by seed: of two that end at once the lower one wins
            answer = process.answer() if process.channel in ready else process.overdue()
            if isinstance(answer, Progress):
                report(process.request.seed, answer)
            elif isinstance(answer, Outcome):
                return process.request, answer
            elif isinstance(answer, RbprmError):
                failures.append(answer)
                processes.remove(process)
    raise max(failures, key=how_far)


def how_far(error: RbprmError) -> tuple[float, int]:
    """How far a failed attempt came: covered share of its guide, then rank of its last stage."""
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


class _SeedProcess:
    """A running process of the portfolio.

    Attributes:
        task: its work.
        request: the request with the seed that it plans with now.
        channel: connection to it.
    """

    def __init__(self, task: Task) -> None:
        self.task, self.request = task, task.request
        self._stage, self._deadline = "robot data", float("inf")
        self._process = ChildProcess(COMMAND)
        self.channel = self._process.channel
        self.end = self._process.end

    def begin(self) -> None:
        """Send the task."""
        with contextlib.suppress(ChannelClosed):  # it died at once, which `answer` then returns
            self.channel.send(self.task)

    def answer(self) -> Answer:
        """The next message of the process; `ProcessDied` where it has ended."""
        try:
            answer: Answer = self.channel.receive()
        except ChannelClosed:
            return ProcessDied(self.request.seed, self._process.wait())
        if isinstance(answer, Started):
            self.request = replace(self.request, seed=answer.seed)
            self._deadline = min(self._deadline, time.monotonic() + self.task.time_limit + GRACE)
        elif isinstance(answer, Progress):
            self._stage = answer.stage
        return answer

    def overdue(self) -> TimeLimitReached | None:
        """End a process that runs on after its time limit; None for any other."""
        if time.monotonic() <= self._deadline:
            return None
        self.end()
        return TimeLimitReached(self.task.time_limit, self._stage)
