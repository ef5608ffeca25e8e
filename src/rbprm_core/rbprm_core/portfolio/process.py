"""A process of a portfolio: plans the one task that it receives, seed after seed.

`plan_portfolio` starts it as `python -m rbprm_core.portfolio.process FILE_DESCRIPTOR`.
"""

from __future__ import annotations

import sys
import time
import traceback
from dataclasses import replace
from itertools import count

from rbprm_core.budget import Budget, Progress
from rbprm_core.errors import NoGuideFound, NoSequenceFound, RbprmError
from rbprm_core.outcome import Outcome
from rbprm_core.planner import plan
from rbprm_core.portfolio.portfolio import Started, Task, how_far
from rbprm_core.processes import Channel, ChannelClosed, ReportThrottle, serve_parent
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData, load_robot_data

REPORT_PERIOD = 0.1  # seconds


class Reporter:
    """Sends progress to the parent.

    Args:
        channel: connection to the parent.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel, self._throttle = channel, ReportThrottle(REPORT_PERIOD)

    def __call__(self, progress: Progress) -> None:
        """Send progress, at most once in a period and a stage."""
        if self._throttle.passes(progress):
            self._channel.send(progress)


def serve(channel: Channel) -> None:
    """Plan the task from the channel and send the outcome, or the error that ended it."""
    channel.send(_answer(channel))


def _answer(channel: Channel) -> Outcome | RbprmError:
    """The outcome of the task, or the error that ended it."""
    started, report = time.monotonic(), Reporter(channel)

    def loading(fraction: float) -> None:
        report(Progress("robot data", fraction, 0, time.monotonic() - started))

    try:
        task: Task = channel.receive()
        sys.path[:] = task.search_path
        data = load_robot_data(Robot.load(task.description), loading)
        return _first(task, data, channel, report)
    except RbprmError as error:
        return error
    except ChannelClosed:
        raise
    except Exception as error:  # a fault of the planner; the other processes go on
        traceback.print_exc()
        return RbprmError(f"a fault of the planner: {type(error).__name__}: {error}")


def _first(task: Task, data: RobotData, channel: Channel, report: Reporter) -> Outcome | RbprmError:
    """The first success of the task's seeds in its time; else the failure that came farthest."""
    budget = Budget(task.time_limit, report=report)
    best: list[RbprmError] = []
    for seed in count(task.request.seed, task.stride):
        channel.send(Started(seed))
        try:
            return plan(replace(task.request, seed=seed), data, task.scene, budget)
        except (NoGuideFound, NoSequenceFound) as error:
            best = [max([*best, error], key=how_far)]
        except RbprmError as error:
            return max([*best, error], key=how_far)
    raise AssertionError("the time of a portfolio is limited")


if __name__ == "__main__":
    serve_parent(serve)
