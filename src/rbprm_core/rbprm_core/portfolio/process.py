"""A process of a portfolio: plans the one task that comes over its pipe, seed after seed.

Started by `plan_portfolio` as `python -m rbprm_core.portfolio.process FILE_DESCRIPTOR`.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import time
import traceback
from dataclasses import replace
from itertools import count
from multiprocessing.connection import Connection

from rbprm_core.budget import Budget, Progress
from rbprm_core.errors import NoGuideFound, NoSequenceFound, RbprmError
from rbprm_core.planner import Outcome, plan
from rbprm_core.portfolio.portfolio import Answer, Started, Task, how_far
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData, load_robot_data

REPORT_PERIOD = 0.1  # seconds; the planner tells its progress much more often than anyone looks


class CallerGone(Exception):
    """Nobody is at the other end of the pipe any more."""


class Line:
    """The pipe: one task comes in, progress and the answer go out."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._stage, self._next = "", 0.0

    def receive(self) -> Task:
        """The task."""
        try:
            task: Task = self._pipe.recv()
        except (EOFError, OSError) as error:
            raise CallerGone from error
        return task

    def send(self, answer: Answer) -> None:
        """Say something; the end of the caller is that of this process too."""
        try:
            self._pipe.send(answer)
        except OSError as error:
            raise CallerGone from error

    def report(self, progress: Progress) -> None:
        """Tell the progress, at most once in a period and a stage."""
        now = time.monotonic()
        if progress.stage != self._stage or now >= self._next:
            self._stage, self._next = progress.stage, now + REPORT_PERIOD
            self.send(progress)


def main() -> None:
    """Plan, and send the outcome or what went wrong."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the caller, who then ends us
    line = Line(Connection(int(sys.argv[1])))
    with contextlib.suppress(CallerGone):
        line.send(_answer(line))


def _answer(line: Line) -> Outcome | RbprmError:
    """Do the task; whatever goes wrong is an answer too."""
    started = time.monotonic()

    def loading(fraction: float) -> None:
        line.report(Progress("robot data", fraction, 0, time.monotonic() - started))

    try:
        task = line.receive()
        sys.path[:] = task.search_path
        data = load_robot_data(Robot.load(task.description), loading)
        return _first(task, data, line)
    except RbprmError as error:
        return error
    except CallerGone:
        raise
    except Exception as error:  # a fault of ours; the others go on
        traceback.print_exc()
        return RbprmError(f"a fault of the planner: {type(error).__name__}: {error}")


def _first(task: Task, data: RobotData, line: Line) -> Outcome | RbprmError:
    """The first success of the task's seeds in its time; else the failure that came farthest."""
    budget = Budget(task.time_limit, report=line.report)
    best: list[RbprmError] = []
    for seed in count(task.request.seed, task.stride):
        line.send(Started(seed))
        try:
            return plan(replace(task.request, seed=seed), data, task.scene, budget)
        except (NoGuideFound, NoSequenceFound) as error:
            best = [max([*best, error], key=how_far)]
        except RbprmError as error:
            return max([*best, error], key=how_far)
    raise AssertionError("the time of a portfolio is limited")


if __name__ == "__main__":
    main()
