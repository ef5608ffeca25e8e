"""The pipeline from a request to a plan: guide (P1), contact sequence (P2), and new guides.

A guide that no contact sequence follows teaches the guide planner which root to avoid; then another
guide is searched, until the time limit.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.contacts.contact_options import ContactOptions
from rbprm_core.contacts.heuristics import HEURISTICS
from rbprm_core.contacts.protocol import ContactPlanner, ContactProblem, OnStates
from rbprm_core.contacts.registry import CONTACT_PLANNERS
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
from rbprm_core.guide.protocol import Guide, GuidePlanner, GuideProblem
from rbprm_core.guide.registry import GUIDE_PLANNERS, guide_planner
from rbprm_core.guide.roadmap import RoadmapStore
from rbprm_core.guide.root_space import RootSpace
from rbprm_core.outcome import Outcome
from rbprm_core.placement import Placement
from rbprm_core.plan_record import Statistics
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.stages import TIMED, Stage

GUIDES_BEFORE_GOAL_TEST = 20
"""Failed guides after which the goal's contacts are tested.

A plan is mostly found sooner, which saves the time of the test; a goal that admits no contacts must
not cost the whole time limit.
"""
VERSIONED = ("rbprm_core", "pin", "coal", "daqp", "numpy")


def plan(
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    budget: Budget,
    roadmaps: RoadmapStore | None = None,
    *,
    history: Sequence[State] = (),
    on_states: OnStates | None = None,
) -> Outcome:
    """A contact sequence from start to goal.

    The same request, data and scene give the same outcome in any process; with kept roadmaps, the
    outcome depends on the roadmaps' earlier use, too.

    Args:
        request: start, goal and conditions.
        data: the robot with its precomputed data.
        scene: supporting surfaces and obstacles.
        budget: time limit, cancel flag and progress.
        roadmaps: roadmaps that the caller keeps between requests, for guide planners that use one.
        history: states of an earlier sequence or a measured state, to go on from the last one. The
            guide starts at its root; start and start_limbs of the request are not used. The first
            state of the outcome is this state, with ids and friction of the scene's surfaces.
        on_states: called with the states so far whenever one is added; with every guide it starts
            again from the first state.

    Raises:
        InvalidInput: a request that cannot be used.
        StartUnreachable, GoalUnreachable: no contact state there.
        NoGuideFound: no guide was found at all.
        NoSequenceFound: of the attempt that covered the largest share of its guide, once
            `options.guides` guides were tried.
        TimeLimitReached, Cancelled: from the budget; guides are tried until then.

        Each carries the statistics up to where it ended, and the states of the attempt that covered
        the largest share of its guide; of equal ones, the earliest.
    """
    pipeline = _Pipeline(request, data, scene, budget, roadmaps, tuple(history), on_states)
    try:
        return pipeline.run()
    except RbprmError as error:
        error.statistics = pipeline.statistics()
        raise


class _Pipeline:
    """One request on its way through the stages.

    Attributes:
        best: failure of the ended attempt that covered the largest share of its guide.
    """

    def __init__(
        self,
        request: PlanRequest,
        data: RobotData,
        scene: Scene,
        budget: Budget,
        roadmaps: RoadmapStore | None,
        history: tuple[State, ...],
        on_states: OnStates | None,
    ) -> None:
        self._request = request.validated([limb.name for limb in data.robot.limbs])
        self._budget = budget
        self._data, self._scene, self._roadmaps = data, scene, roadmaps
        self._history = history
        self._on_states = on_states if on_states is not None else lambda states: None
        self._rng = np.random.default_rng(request.seed)
        self._seconds: dict[str, float] = dict.fromkeys(TIMED, 0.0)
        self._guide_counters, self._contact_counters = Counters(), Counters()
        self._nodes = self._guides = 0
        self._versions: dict[str, str] = {}
        self.best: NoSequenceFound | None = None

    def run(self) -> Outcome:
        """Try guides until a contact sequence follows one."""
        with _Clock(self._seconds, Stage.PREPARE):
            self._prepare()
        first = self._first_state()
        try:
            return self._first_success(first)
        except (GoalUnreachable, TimeLimitReached, Cancelled) as error:
            if self.best is None:
                raise
            raise _with_best(error, self.best) from error

    def statistics(self, states: int = 0) -> Statistics:
        """Seconds by stage, counts and versions so far.

        Args:
            states: number of states of the plan.
        """
        shortcut = self._guide_counters.seconds.get(Stage.SHORTCUT, 0.0)
        seconds = dict(self._seconds)
        seconds[Stage.GUIDE] -= shortcut
        seconds[Stage.SHORTCUT] = shortcut
        contacts = self._contact_counters
        operations = {f"{Stage.CONTACTS}.{k}": v for k, v in contacts.seconds.items()}
        counts = {"guides": self._guides, "guide_nodes": self._nodes, "states": states}
        return Statistics(
            time={**seconds, "total": sum(seconds.values()), **operations},
            counts={**counts, **contacts.counts},
            versions={**{name: _version(name) for name in VERSIONED}, **self._versions},
        )

    def _prepare(self) -> None:
        """Resolve the request against robot and scene, and build the planners of the stages."""
        request, robot = self._request, self._data.robot
        joints = robot.root_index[7:]
        self._space = RootSpace(request.bounds, robot.low[joints], robot.high[joints])
        if self._history:
            self._start = _root_of(self._history[-1], robot)
        else:
            self._start = _root(robot.reference[joints], request.start)
        self._goal = _root(robot.reference[joints], request.goal)
        self._budget.check(Stage.START)
        self._guide_planner = self._make_guide_planner()
        self._budget.poll()
        self._contact_planner = self._make_contact_planner()
        used = [name for limb in robot.limbs for name in limb.heuristics]
        self._versions.update(HEURISTICS.versions(used))

    def _make_guide_planner(self) -> GuidePlanner:
        request, name = self._request, self._request.stages.guide
        problem = GuideProblem(
            data=self._data,
            scene=self._scene,
            start=self._start,
            goal=self._goal,
            space=self._space,
            required_limbs=request.required_limbs,
            gravity=request.gravity,
            options=request.options.guide,
            budget=self._budget,
            roadmaps=self._roadmaps,
            counters=self._guide_counters,
        )
        planner = guide_planner(name, problem)
        self._versions.update(GUIDE_PLANNERS.versions([name]))
        return planner

    def _make_contact_planner(self) -> ContactPlanner:
        request, name = self._request, self._request.stages.contacts
        make = CONTACT_PLANNERS.get(name, "stages.contacts")
        self._versions.update(CONTACT_PLANNERS.versions([name]))
        names = [limb.name for limb in self._data.robot.limbs]
        planner = make(
            ContactProblem(
                data=self._data,
                scene=self._scene,
                gravity=request.gravity,
                robustness_threshold=request.robustness_threshold,
                rng=self._rng,
                start_limbs=tuple(names.index(name) for name in request.start_limbs),
                goal_limbs=tuple(names.index(name) for name in request.goal_limbs or ()),
                grip_force=request.grip_force,
                options=ContactOptions(request.options.generator, request.options.sequence),
                budget=self._budget,
            )
        )
        self._contact_counters = planner.counters
        return planner

    def _first_state(self) -> State:
        """The first state; raises where start or goal admit none."""
        request, history = self._request, self._history
        self._budget.check(Stage.START)
        if history:
            self._space.require(self._start, _placement(self._start), "history.root")
        else:
            self._space.require(self._start, request.start, "start")
        self._space.require(self._goal, request.goal, "goal")
        # A state with contacts has shown that its limbs reach surfaces: only its trunk is tested.
        guide = self._guide_planner
        failure = guide.trunk_failure(self._start) if history else guide.failure(self._start)
        if failure is not None:
            raise StartUnreachable(failure)
        failure = guide.failure(self._goal)
        if failure is not None:
            raise GoalUnreachable(failure)
        self._budget.poll()
        with _Clock(self._seconds, Stage.CONTACTS):
            if history:
                return self._contact_planner.resume(history)
            return self._contact_planner.start(self._start)

    def _first_success(self, first: State) -> Outcome:
        """The first guide that a sequence follows, and the sequence; raises where none does."""
        max_guides = self._request.options.guides
        for attempt in range(1, max_guides + 1):
            try:
                guide = self._guide(direct=attempt == 1)
                states = self._sequence(guide, first)
            except NoSequenceFound as error:
                if self.best is None or error.fraction > self.best.fraction:
                    self.best = error
                self._avoid(guide, error)
            except NoGuideFound:
                if self.best is None:
                    raise
                self._guide_planner.forget()  # the avoided roots may have closed the only way
            else:
                return Outcome(guide, tuple(states), self.statistics(len(states)))
            if attempt == min(GUIDES_BEFORE_GOAL_TEST, max_guides):
                self._contact_planner.check_goal(self._goal)
        assert self.best is not None  # at least one guide is tried
        raise self.best

    def _guide(self, direct: bool) -> Guide:
        """A guide path (P1)."""
        with _Clock(self._seconds, Stage.GUIDE):
            found = self._guide_planner.find(self._budget, self._rng, direct=direct)
        self._nodes += found.nodes
        self._guides += 1
        return found.guide

    def _sequence(self, guide: Guide, first: State) -> list[State]:
        """The contact sequence along a guide (P2)."""
        with _Clock(self._seconds, Stage.CONTACTS):
            history = (*self._history[:-1], first)
            return self._contact_planner.follow(guide, history, self._on_states)

    def _avoid(self, guide: Guide, error: NoSequenceFound) -> None:
        """Keep the next guide away from the root at which the sequence stopped."""
        stopped = guide.root(error.fraction * guide.length + self._request.options.sequence.step)
        self._guide_planner.avoid(stopped, keep=(self._start, self._goal))


class _Clock:
    """Adds the seconds spent in a block to a stage; they are reported and decide nothing."""

    def __init__(self, seconds: dict[str, float], stage: Stage) -> None:
        self._seconds, self._stage = seconds, stage

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds[self._stage] += time.perf_counter() - self._start


def _root(joints: Array, placement: Placement) -> Array:
    return np.concatenate([placement.position, placement.orientation, joints])


def _root_of(state: State, robot: Robot) -> Array:
    """The root configuration (7 + j,) of a state.

    Raises:
        InvalidInput: a configuration of another robot.
    """
    if state.q.shape != robot.low.shape:
        reason = f"has {len(state.q)} numbers, the robot {robot.name} has {len(robot.low)}"
        raise InvalidInput("history.q", state.q.tolist(), reason)
    return np.asarray(state.q[robot.root_index])


def _placement(root: Array) -> Placement:
    return Placement(root[:3], root[3:7])


def _with_best(
    error: GoalUnreachable | TimeLimitReached | Cancelled, best: NoSequenceFound
) -> RbprmError:
    """The error with the states of the attempt that covered the largest share of its guide."""
    # Not by the number of states: a winding guide has more of them, and may lead less far.
    farthest = error if error.fraction > best.fraction else best
    states, fraction = farthest.states, farthest.fraction
    result: RbprmError = error
    if isinstance(error, TimeLimitReached):
        result = TimeLimitReached(error.limit, error.stage, best)
    result.states, result.fraction = states, fraction
    return result


@cache
def _version(name: str) -> str:
    """Version of an installed package; its metadata are read once, which takes 0.3 ms."""
    try:
        return version(name)
    except PackageNotFoundError as error:
        raise RbprmError(f"package {name} is not installed properly") from error
