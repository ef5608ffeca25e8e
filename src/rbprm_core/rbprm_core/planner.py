"""Request to plan: the guide (P1), the sequence along it (P2), and new guides where it stops."""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

import numpy as np
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.contacts import ContactGenerator, State, plan_sequence, start_state
from rbprm_core.errors import (
    GoalUnreachable,
    InvalidInput,
    NoGuideFound,
    NoSequenceFound,
    RbprmError,
    StartUnreachable,
    TimeLimitReached,
)
from rbprm_core.guide import GuidePath, Reachability, RootSpace, plan_rrt, shorten
from rbprm_core.guide.rrt import Edge
from rbprm_core.guide.sampler import RootSampler
from rbprm_core.guide.settle import Settler
from rbprm_core.placement import Placement
from rbprm_core.plan import Statistics
from rbprm_core.request import PlanRequest, limb_names
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.validation import finite_number

Array = NDArray[np.float64]

VERSIONED = ("rbprm_core", "pin", "coal", "daqp", "numpy")


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the planner found.

    Attributes:
        guide: the path of the root. states: the contact sequence along it.
        statistics: seconds by phase, counts and versions.
    """

    guide: GuidePath
    states: tuple[State, ...]
    statistics: Statistics


def plan(request: PlanRequest, data: RobotData, scene: Scene, budget: Budget) -> Outcome:
    """Plan a contact sequence from start to goal.

    The same request, data and scene give the same outcome, in any process.

    Raises:
        InvalidInput: start or goal outside the request's own bounds.
        StartUnreachable, GoalUnreachable: no contact configuration there, and why.
        NoGuideFound, NoSequenceFound: of the attempt that came farthest.
        TimeLimitReached, Cancelled: from the budget.
    """
    return _Planning(request, data, scene, budget).run()


class _Planning:
    """One request being planned."""

    def __init__(self, request: PlanRequest, data: RobotData, scene: Scene, budget: Budget) -> None:
        self._request, self._budget = request, budget
        if request.seed < 0:
            raise InvalidInput("seed", request.seed, "must not be negative")
        self._rng = np.random.default_rng(request.seed)
        self._seconds = dict.fromkeys(("prepare", "guide", "shortcut", "sequence"), 0.0)
        self._nodes = self._guides = 0
        with _Clock(self._seconds, "prepare"):
            self._prepare(data, scene)

    def _prepare(self, data: RobotData, scene: Scene) -> None:
        """Resolve the request against robot and scene, and build what answers their queries."""
        request, robot = self._request, data.robot
        required = limb_names(robot, request.required, "required")
        start_limbs = limb_names(robot, request.start_limbs, "start_limbs")
        threshold = finite_number("robustness_threshold", request.robustness_threshold, low=0.0)
        joints = robot.root_index[7:]
        self._space = RootSpace(request.bounds, robot.low[joints], robot.high[joints])
        self._start = _root(robot.reference[joints], request.start)
        self._goal = _root(robot.reference[joints], request.goal)
        self._reachability = Reachability(data, scene, required)
        self._sampler = RootSampler(self._space, scene, self._reachability, data.height)
        self._settler = Settler(data, scene, required)
        self._generator = ContactGenerator(
            data, scene, request.gravity, threshold, request.options.generator
        )
        names = [limb.name for limb in robot.limbs]
        self._start_limbs = [names.index(name) for name in start_limbs]

    def run(self) -> Outcome:
        """Try guides until a sequence follows one."""
        first = self._first_state()
        best: NoSequenceFound | None = None
        for attempt in range(self._request.options.guides):
            try:
                guide = self._guide(direct=attempt == 0)
                states = self._sequence(guide, first)
            except NoSequenceFound as error:
                if best is None or error.fraction > best.fraction:
                    best = error
                self._avoid(guide, error)
            except NoGuideFound:
                if best is None:
                    raise
                break  # what failed on the guides before is the more useful thing to say
            except TimeLimitReached as error:
                raise TimeLimitReached(error.limit, error.stage, best) from error
            else:
                return Outcome(guide, tuple(states), self._statistics(states))
        # No guide led there: a goal that admits no state at all is the more useful thing to say.
        start_state(self._generator, self._goal, self._start_limbs, "goal")
        assert best is not None  # at least one guide is tried
        raise best

    def _first_state(self) -> State:
        """The start state; raises where start or goal admit none."""
        request = self._request
        self._budget.check("start")
        self._space.require(self._start, request.start, "start")
        self._space.require(self._goal, request.goal, "goal")
        for root, error in ((self._start, StartUnreachable), (self._goal, GoalUnreachable)):
            limb, reason = self._reachability.failure(root)
            if reason:
                raise error(reason, limb)
        with _Clock(self._seconds, "sequence"):
            return start_state(self._generator, self._start, self._start_limbs, budget=self._budget)

    def _guide(self, direct: bool) -> GuidePath:
        """P1: a path under the reachability condition, then shortcuts."""
        options = self._request.options
        with _Clock(self._seconds, "guide"):
            path, nodes = plan_rrt(
                self._start, self._goal, self._space, self._reachability, self._sampler,
                self._budget, self._rng, options.rrt, direct=direct,
            )  # fmt: skip
        self._nodes += nodes
        self._guides += 1
        edge = Edge(self._space, self._reachability, options.rrt)
        with _Clock(self._seconds, "shortcut"):
            path = shorten(path, edge, options.shortcuts, self._budget, self._rng)
            return self._settler.settle(path, edge, self._budget) if options.settle else path

    def _sequence(self, guide: GuidePath, first: State) -> list[State]:
        """P2 along a guide."""
        options = self._request.options.sequence
        with _Clock(self._seconds, "sequence"):
            return plan_sequence(self._generator, guide, first, self._budget, self._rng, options)

    def _avoid(self, guide: GuidePath, error: NoSequenceFound) -> None:
        """Keep the next guide away from where the sequence stopped."""
        stopped = guide.at(error.fraction * guide.length + self._request.options.sequence.step)
        self._reachability.avoid(stopped, keep=(self._start, self._goal))

    def _statistics(self, states: list[State]) -> Statistics:
        tally = self._generator.tally
        counts = {"guides": self._guides, "guide_nodes": self._nodes, "states": len(states)}
        seconds = {**self._seconds, "total": sum(self._seconds.values())}
        return Statistics(
            time={**seconds, **{f"sequence.{k}": v for k, v in tally.seconds.items()}},
            counts={**counts, **tally.counts},
            versions={name: _version(name) for name in VERSIONED},
        )


class _Clock:
    """Adds the seconds spent in a block to a phase; they are reported and decide nothing."""

    def __init__(self, seconds: dict[str, float], phase: str) -> None:
        self._seconds, self._phase = seconds, phase

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds[self._phase] += time.perf_counter() - self._start


def _root(joints: Array, placement: Placement) -> Array:
    return np.concatenate([placement.position, placement.orientation, joints])


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError as error:
        raise RbprmError(f"package {name} is not installed properly") from error
