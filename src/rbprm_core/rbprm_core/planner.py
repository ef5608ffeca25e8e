"""Request to plan: the guide (P1), the sequence along it (P2), and new guides where it stops."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

import numpy as np
from numpy.typing import NDArray

from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide import ContactGenerator, plan_sequence, start_state
from rbprm_core.contacts.continuation import continued_state
from rbprm_core.contacts.heuristics import plugin_versions
from rbprm_core.counters import Counters
from rbprm_core.errors import (
    Cancelled,
    GoalUnreachable,
    InvalidInput,
    NoGuideFound,
    NoSequenceFound,
    RbprmError,
    StartUnreachable,
    TimeLimitReached,
)
from rbprm_core.guide.roadmap import roadmap_key
from rbprm_core.guide.root import (
    EdgeTest,
    EquilibriumTest,
    GuidePath,
    Reachability,
    Roadmap,
    RoadmapStore,
    RootProblem,
    RootSampler,
    RootSpace,
    Settler,
    shorten,
)
from rbprm_core.guide.root.planners import make_search
from rbprm_core.guide.root.sampler import effector_places
from rbprm_core.placement import Placement
from rbprm_core.plan_record import Statistics
from rbprm_core.request import PlanRequest, limb_names
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.validation import MAX_FORCE, MAX_GRAVITY, finite_array, finite_number

Array = NDArray[np.float64]

MIN_GRIP = 1e-3  # newtons
TRIED_BEFORE_GOAL = 20
"""Failed guides after which the goal's contacts are tried: a plan is mostly there sooner, and then
their time is saved; a goal that admits none must not cost the whole time limit."""
POSTURE = ("kinematics", "at its reference posture")
"""In the reason why a goal does not admit contacts: with another posture than the reference one,
from which they are tried, it may. So it is for the last rungs of a ladder."""
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


def plan(
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    budget: Budget,
    roadmaps: RoadmapStore | None = None,
    *,
    first: State | None = None,
    on_states: Callable[[Sequence[State]], None] | None = None,
) -> Outcome:
    """Plan a contact sequence from start to goal.

    The same request, data and scene give the same outcome, in any process; with kept roadmaps, the
    outcome depends on what was planned with them before, too.

    Args:
        roadmaps: kept by the caller between requests, for the guide planners that use one.
        first: state to go on from, of an earlier plan or measured. The guide starts at its root,
            and the request's start and start_limbs are not looked at. The first state found is
            this one, with ids and friction of the scene's surfaces.
        on_states: told the states so far whenever there are more; starts over with every guide.

    Raises:
        InvalidInput: start or goal outside the request's own bounds.
        StartUnreachable, GoalUnreachable: no contact configuration there, and why; of `first`, that
            a contact has lost its surface, or that it collides or does not stand.
        NoGuideFound: where none was found at all.
        NoSequenceFound: of the attempt that came farthest, once `options.guides` were tried.
        TimeLimitReached, Cancelled: from the budget; guides are tried until then.

        Each carries the statistics up to where it ended, and the states of the attempt that came
        farthest: that followed the largest share of its guide; of equals, the earliest.
    """
    planning = _Planning(request, data, scene, budget, roadmaps, first, on_states)
    try:
        return planning.run()
    except RbprmError as error:
        error.statistics = planning.statistics()
        raise


class _Planning:
    """One request being planned."""

    def __init__(
        self,
        request: PlanRequest,
        data: RobotData,
        scene: Scene,
        budget: Budget,
        roadmaps: RoadmapStore | None,
        resumed: State | None,
        on_states: Callable[[Sequence[State]], None] | None,
    ) -> None:
        self._request, self._budget = request, budget
        self._resumed = resumed
        self._on_states = on_states if on_states is not None else lambda states: None
        if request.seed < 0:
            raise InvalidInput("seed", request.seed, "must not be negative")
        self._rng = np.random.default_rng(request.seed)
        self._seconds = dict.fromkeys(("prepare", "guide", "shortcut", "sequence"), 0.0)
        self._nodes = self._guides = 0
        self._best: NoSequenceFound | None = None  # of the attempts that have ended
        self._counters, self._plugins = Counters(), dict[str, str]()
        self._data, self._scene, self._roadmaps = data, scene, roadmaps

    def _prepare(self) -> None:
        """Resolve the request against robot and scene, and build what answers their queries."""
        request, data, scene = self._request, self._data, self._scene
        robot = data.robot
        required = limb_names(robot, request.required_limbs, "required_limbs")
        start_limbs = limb_names(robot, request.start_limbs, "start_limbs")
        goal_limbs = limb_names(robot, request.goal_limbs or (), "goal_limbs")
        threshold = finite_number(
            "robustness_threshold", request.robustness_threshold, low=0.0, high=MAX_FORCE
        )
        gravity = finite_array("gravity", request.gravity, (3,))
        if np.abs(gravity).max() > MAX_GRAVITY:
            raise InvalidInput("gravity", request.gravity, f"is over {MAX_GRAVITY:g} m/s^2")
        grip_force = finite_number("grip_force", request.grip_force, low=MIN_GRIP, high=MAX_FORCE)
        joints = robot.root_index[7:]
        self._space = RootSpace(request.bounds, robot.low[joints], robot.high[joints])
        if self._resumed is None:
            self._start = _root(robot.reference[joints], request.start)
        else:
            self._start = _root_of(self._resumed, robot)
        self._goal = _root(robot.reference[joints], request.goal)
        self._budget.check("start")
        self._prepare_guide(data, scene, required, gravity)
        self._budget.poll()
        self._settler = Settler(data, scene, required)
        self._budget.poll()
        self._generator = ContactGenerator(
            data, scene, gravity, threshold, request.options.generator, self._rng, grip_force,
            self._budget,
        )  # fmt: skip
        self._counters = self._generator.counters
        used = [name for limb in robot.limbs for name in limb.heuristics]
        self._plugins = plugin_versions(used)
        names = [limb.name for limb in robot.limbs]
        self._start_limbs = [names.index(name) for name in start_limbs]
        self._goal_limbs = [names.index(name) for name in goal_limbs]

    def _prepare_guide(
        self,
        data: RobotData,
        scene: Scene,
        required: tuple[str, ...],
        gravity: Array,
    ) -> None:
        """Build the condition and the guide planner that the request names."""
        options, space = self._request.options.guide, self._space
        equilibrium = (
            EquilibriumTest(data, scene, required, gravity) if options.equilibrium else None
        )
        condition = Reachability(data, scene, required, equilibrium, self._budget)
        self._reachability, self._edges = condition, EdgeTest(space, condition, options.resolution)
        joints = data.robot.reference[data.robot.root_index[7:]]
        reach = None if gravity.any() else effector_places(data)
        sampler = RootSampler(space, scene, condition, data.height, joints, reach)
        problem = RootProblem(self._start, self._goal, self._edges, sampler)

        def roadmap() -> Roadmap:
            if self._roadmaps is None:
                return Roadmap()
            key = roadmap_key(data, space, required, options, gravity)
            return self._roadmaps.roadmap(key, scene, condition.radius)

        self._search = make_search(problem, options, roadmap)

    def run(self) -> Outcome:
        """Try guides until a sequence follows one."""
        with _Clock(self._seconds, "prepare"):
            self._prepare()
        first = self._first_state()
        try:
            return self._first_success(first)
        except (GoalUnreachable, TimeLimitReached, Cancelled) as error:
            if self._best is None:
                raise
            raise _with_best(error, self._best) from error

    def _first_success(self, first: State) -> Outcome:
        """The first guide that a sequence follows, and the sequence; raises where none does."""
        most = self._request.options.guides
        for attempt in range(1, most + 1):
            try:
                guide = self._guide(direct=attempt == 1)
                states = self._sequence(guide, first)
            except NoSequenceFound as error:
                if self._best is None or error.fraction > self._best.fraction:
                    self._best = error
                self._avoid(guide, error)
            except NoGuideFound:
                if self._best is None:
                    raise
                self._reachability.forget()  # the roots avoided may have closed the only way
            else:
                return Outcome(guide, tuple(states), self.statistics(len(states)))
            if attempt == min(TRIED_BEFORE_GOAL, most):
                self._try_goal()
        assert self._best is not None  # at least one guide is tried
        raise self._best

    def _try_goal(self) -> None:
        """Raises where the goal does not admit the limbs asked for: no guide leads there then.

        Where no limbs are asked for, any may do, and no single try tells.
        """
        if not self._goal_limbs:
            return
        try:
            start_state(self._generator, self._goal, self._goal_limbs, "goal", self._budget)
        except GoalUnreachable as error:
            if not any(part in error.reason for part in POSTURE):
                raise

    def _first_state(self) -> State:
        """The start state; raises where start or goal admit none."""
        request, resumed = self._request, self._resumed
        self._budget.check("start")
        if resumed is None:
            self._space.require(self._start, request.start, "start")
        else:
            self._space.require(self._start, _placement(self._start), "first.root")
        self._space.require(self._goal, request.goal, "goal")
        limb, reason = self._start_failure()
        if reason:
            raise StartUnreachable(reason, limb)
        limb, reason = self._reachability.failure(self._goal)
        if reason:
            raise GoalUnreachable(reason, limb)
        self._budget.poll()
        with _Clock(self._seconds, "sequence"):
            if resumed is not None:
                return continued_state(self._generator, resumed)
            return start_state(self._generator, self._start, self._start_limbs, budget=self._budget)

    def _start_failure(self) -> tuple[str, str]:
        """Limb and reason why no guide leaves the start; ("", "") where one may.

        A state with contacts has shown better than the condition that its limbs reach surfaces.
        """
        if self._resumed is None:
            return self._reachability.failure(self._start)
        return "", self._reachability.blocked(self._start)

    def _guide(self, direct: bool) -> GuidePath:
        """P1: a path under the reachability condition, then shortcuts."""
        options = self._request.options
        with _Clock(self._seconds, "guide"):
            path, nodes = self._search.find(self._budget, self._rng, direct=direct)
        self._nodes += nodes
        self._guides += 1
        with _Clock(self._seconds, "shortcut"):
            path = shorten(path, self._edges, options.shortcuts, self._budget, self._rng)
            if options.settle and self._request.gravity.any():
                path = self._settler.settle(path, self._edges, self._budget)
            return path

    def _sequence(self, guide: GuidePath, first: State) -> list[State]:
        """P2 along a guide."""
        options = self._request.options.sequence
        with _Clock(self._seconds, "sequence"):
            return plan_sequence(
                self._generator, guide, first, self._budget, self._rng, options, self._goal_limbs,
                self._on_states,
            )  # fmt: skip

    def _avoid(self, guide: GuidePath, error: NoSequenceFound) -> None:
        """Keep the next guide away from where the sequence stopped."""
        stopped = guide.at(error.fraction * guide.length + self._request.options.sequence.step)
        self._reachability.avoid(stopped, keep=(self._start, self._goal))

    def statistics(self, states: int = 0) -> Statistics:
        """Seconds by phase, counts and versions so far, and how many states there are."""
        counters = self._counters
        counts = {"guides": self._guides, "guide_nodes": self._nodes, "states": states}
        seconds = {**self._seconds, "total": sum(self._seconds.values())}
        return Statistics(
            time={**seconds, **{f"sequence.{k}": v for k, v in counters.seconds.items()}},
            counts={**counts, **counters.counts},
            versions={**{name: _version(name) for name in VERSIONED}, **self._plugins},
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


def _root_of(state: State, robot: Robot) -> Array:
    """The root configuration of a state.

    Raises:
        InvalidInput: a configuration of another robot.
    """
    if state.q.shape != robot.low.shape:
        reason = f"has {len(state.q)} numbers, the robot {robot.name} has {len(robot.low)}"
        raise InvalidInput("first.q", state.q.tolist(), reason)
    return np.asarray(state.q[robot.root_index])


def _placement(root: Array) -> Placement:
    return Placement(root[:3], root[3:7])


def _with_best(
    error: GoalUnreachable | TimeLimitReached | Cancelled, best: NoSequenceFound
) -> RbprmError:
    """The error with the states of the attempt that came farthest: the one that it ended, or the
    best before."""
    told: RbprmError
    if isinstance(error, TimeLimitReached):
        told = TimeLimitReached(error.limit, error.stage, best)
    elif isinstance(error, Cancelled):
        told = Cancelled(error.stage)
    else:
        told = GoalUnreachable(error.reason, error.limb)
    # Not by their number: a guide that winds has more of them, and may lead less far.
    farthest = error if error.fraction > best.fraction else best
    told.states, told.fraction = farthest.states, farthest.fraction
    return told


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError as error:
        raise RbprmError(f"package {name} is not installed properly") from error
