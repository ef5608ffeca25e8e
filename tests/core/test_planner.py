"""Planning as a whole: clean plans, the same again in any process, and every way to fail."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NoReturn

import numpy as np
import pytest
from numpy.typing import NDArray

from rbprm_core.body.state import State
from rbprm_core.budget import Budget, Progress
from rbprm_core.check import check_plan
from rbprm_core.contacts.along_guide import ContactGenerator, start_state
from rbprm_core.environment import load_scene
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
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.root import GuideOptions, GuidePath, Reachability, RootBounds, RrtOptions
from rbprm_core.outcome import Outcome
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan, EnvironmentEntry, MeshEntry, SurfaceEntry
from rbprm_core.planner import plan
from rbprm_core.request import PlannerOptions, PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Classification, Scene, Surface, make_surface

Array = NDArray[np.float64]
Box = Callable[..., list[Surface]]
Outcomes = dict[int, tuple[PlanRequest, Outcome]]
SQUARE = ((-5.0, -5.0, 0.0), (5.0, -5.0, 0.0), (5.0, 5.0, 0.0), (-5.0, 5.0, 0.0))
GROUND = EnvironmentEntry(name="ground", surfaces=(SurfaceEntry(id="ground", vertices=SQUARE),))
LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
ALONG_GUIDE = "rbprm_core.contacts.along_guide.planner"
NO_GUIDE = Failure.of(Cause.TREES_NOT_CONNECTED, samples=40, start_nodes=1, goal_nodes=1)
NO_WAY = Failure.of(Cause.ROOT_COLLISION)
FEW = PlannerOptions(guide=GuideOptions(rrt=RrtOptions(iterations=40)), guides=2)

PROGRAM = """
import json, sys
from rbprm_core.budget import Budget
from rbprm_core.planner import plan
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.data import load_robot_data
from rbprm_core.scenario import load_scenario
scenario = load_scenario("rubble")
robot = Robot.load(load_description("hyq"))
request = scenario.request_for(robot, 1)
outcome = plan(request, load_robot_data(robot), scenario.scene(), Budget(60.0))
found = contact_plan(outcome, request, robot, scenario.environment_entry())
print(json.dumps(found.model_dump(mode="json")["states"]))
"""


def walk_to(x: float, **changes: Any) -> PlanRequest:
    """HyQ on level ground from the origin."""
    bounds = RootBounds(np.array([-5.0, -5, 0]), np.array([5.0, 5, 3]), np.array([0.5, 0.2, 0.2]))
    request = PlanRequest(
        start=Placement.parse((0, 0, 0.6)),
        goal=Placement.parse((x, 0, 0.6)),
        bounds=bounds,
        required_limbs=LEGS,
        start_limbs=LEGS,
        robustness_threshold=5.0,
    )
    return replace(request, **changes)


def island(name: str, low: float, high: float) -> Surface:
    ring = [[low, -2, 0], [high, -2, 0], [high, 2, 0], [low, 2, 0]]
    return make_surface(name, ring, 0.5)


def assert_clean(found: ContactPlan) -> None:
    report = check_plan(found)
    assert [str(violation) for violation in report.violations] == []
    assert report.states == len(found.states) > 1
    assert report.min_robustness >= found.request.robustness_threshold - 1e-3


def test_the_rubble_is_crossed_cleanly(rubble_plans: dict[int, ContactPlan]) -> None:
    for found in rubble_plans.values():
        assert_clean(found)
        assert found.states[0].root.position == found.request.start.position
        assert found.states[-1].root.position == pytest.approx(found.request.goal.position)


@pytest.mark.parametrize("seed", [0, 11])
def test_flat_ground_is_crossed_cleanly(hyq_data: RobotData, seed: int) -> None:
    text = load_scenario("flat")
    request = text.request_for(hyq_data.robot, seed)
    outcome = plan(request, hyq_data, text.scene(), Budget(60.0))
    assert_clean(contact_plan(outcome, request, hyq_data.robot, text.environment_entry()))


@pytest.mark.parametrize("drop", [0.0, 1e-6])
def test_ground_without_friction_is_crossed_cleanly(hyq_data: RobotData, drop: float) -> None:
    """Level, and as a mesh in single precision has it: 1e-7 rad off."""
    corners = tuple((x, y, drop * (x > 0)) for x, y, _ in SQUARE)
    ice = EnvironmentEntry(surfaces=(SurfaceEntry(id="ice", vertices=corners, friction=0.0),))
    scene = load_scene(ice, Classification())
    outcome = plan(walk_to(0.5), hyq_data, scene, Budget(60.0))
    assert_clean(contact_plan(outcome, walk_to(0.5), hyq_data.robot, ice))


def test_another_robot_crosses_the_rubble(
    anymal_data: RobotData, rubble: Scenario, rubble_scene: Scene
) -> None:
    request = rubble.request_for(anymal_data.robot, 0)
    outcome = plan(request, anymal_data, rubble_scene, Budget(60.0))
    assert_clean(contact_plan(outcome, request, anymal_data.robot, rubble.environment_entry()))


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", ["flat", "step20"])
def test_a_humanoid_walks_and_climbs_cleanly(talos_data: RobotData, name: str, seed: int) -> None:
    text = load_scenario(name)
    request = text.request_for(talos_data.robot, seed)
    outcome = plan(request, talos_data, text.scene(), Budget(60.0))
    found = contact_plan(outcome, request, talos_data.robot, text.environment_entry())
    assert_clean(found)
    assert found.states[-1].root.position == pytest.approx(request.goal.position)
    contacts = [contact for state in found.states for contact in state.contacts]
    assert all(contact.type == "planar" and len(contact.points) == 4 for contact in contacts)
    if name == "step20":
        assert {contact.surface for contact in contacts} == {"ground", "step"}


def test_a_humanoids_plan_is_the_same_again(talos_data: RobotData) -> None:
    text = load_scenario("step20")
    request = text.request_for(talos_data.robot, 5)
    one, other = (plan(request, talos_data, text.scene(), Budget(60.0)) for _ in range(2))
    assert np.array_equal(one.guide.nodes, other.guide.nodes)
    assert len(one.states) == len(other.states)
    for here, there in zip(one.states, other.states, strict=True):
        assert np.array_equal(here.q, there.q)
        assert here.robustness == there.robustness
        for contact, same in zip(here.contacts, there.contacts, strict=True):
            assert (contact.limb, contact.surface) == (same.limb, same.surface)
            assert np.array_equal(contact.points, same.points)


def test_a_users_own_robot_walks(toy_data: RobotData, flat_scene: Scene) -> None:
    limbs = tuple(limb.name for limb in toy_data.robot.limbs)
    height = toy_data.height + 0.01
    turned = (0, 0, np.sin(0.1), np.cos(0.1))
    request = walk_to(
        1.0,
        start=Placement.parse((0, 0, height)),
        goal=Placement.parse((1.0, 0.2, height), turned),
        required_limbs=limbs,
        start_limbs=limbs,
        robustness_threshold=2.0,
    )
    outcome = plan(request, toy_data, flat_scene, Budget(60.0))
    assert_clean(contact_plan(outcome, request, toy_data.robot, GROUND))


def test_an_obstacle_on_the_way_is_passed(hyq_data: RobotData, make_box: Box) -> None:
    low, high = np.array([1.2, -4, 0.0]), np.array([1.5, 0.6, 2.0])
    wall = make_box("wall", low, high)
    request = walk_to(
        2.5, bounds=RootBounds(np.array([-1.0, -2, 0.3]), np.array([4.0, 2, 1]), np.ones(3))
    )
    scene = Scene([*Scene([make_surface("ground", SQUARE, 0.5)]).surfaces, *wall])
    outcome = plan(request, hyq_data, scene, Budget(60.0))
    assert outcome.guide.nodes[:, 1].max() > 0.6
    entries = [
        SurfaceEntry(id=face.id, vertices=tuple(map(tuple, face.polygon.boundary.tolist())))
        for face in wall
    ]
    environment = EnvironmentEntry(name="wall", surfaces=(*GROUND.surfaces, *entries))
    assert_clean(contact_plan(outcome, request, hyq_data.robot, environment))


def test_the_same_states_in_two_other_processes(rubble_plans: dict[int, ContactPlan]) -> None:
    here = json.dumps(rubble_plans[1].model_dump(mode="json")["states"]) + "\n"
    runs = [
        subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE) for _ in range(2)
    ]
    there = [run.communicate(timeout=120)[0] for run in runs]
    assert there[0] == there[1]
    assert there[0] == here.encode()


def test_neither_robot_data_nor_scene_remember_a_plan(
    hyq_data: RobotData, rubble_scene: Scene, outcomes: Outcomes
) -> None:
    request, before = outcomes[0]
    again = plan(request, hyq_data, rubble_scene, Budget(60.0))
    assert np.array_equal(before.guide.nodes, again.guide.nodes)
    for old, new in zip(before.states, again.states, strict=True):
        assert np.array_equal(old.q, new.q)


def test_start_and_goal_may_be_one(hyq_data: RobotData, flat_scene: Scene) -> None:
    request = walk_to(0.0)
    outcome = plan(request, hyq_data, flat_scene, Budget(60.0))
    found = contact_plan(outcome, request, hyq_data.robot, GROUND)
    assert check_plan(found).valid


def test_statistics(outcomes: Outcomes) -> None:
    for _, outcome in outcomes.values():
        seconds = outcome.statistics.time
        phases = {k: v for k, v in seconds.items() if k != "total" and "." not in k}
        assert {"guide", "shortcut", "sequence"} <= phases.keys()
        assert min(phases.values()) > 0
        assert seconds["total"] == pytest.approx(sum(phases.values()))
        assert outcome.statistics.counts["states"] == len(outcome.states)
        assert outcome.statistics.counts["guides"] >= 1
        assert {"rbprm_core", "pin", "numpy"} <= outcome.statistics.versions.keys()


def test_progress_goes_through_the_stages(hyq_data: RobotData, flat_scene: Scene) -> None:
    told: list[Progress] = []
    plan(walk_to(1.0), hyq_data, flat_scene, Budget(60.0, report=told.append))
    stages = list(dict.fromkeys(progress.stage for progress in told))
    assert stages == [s for s in ("start", "guide", "shortcut", "sequence") if s in stages]
    assert {"start", "guide", "sequence"} <= set(stages)
    assert all(0 <= progress.fraction <= 1 for progress in told)
    assert [p.elapsed for p in told] == sorted(p.elapsed for p in told)


@pytest.mark.parametrize("limit", [1e-3, 0.04])  # before, and amid the 0.1 s of a fast machine
def test_a_time_limit_is_kept(
    hyq_data: RobotData, rubble_scene: Scene, outcomes: Outcomes, limit: float
) -> None:
    budget = Budget(limit)
    with pytest.raises(TimeLimitReached) as caught:
        plan(outcomes[0][0], hyq_data, rubble_scene, budget)
    assert caught.value.limit == limit
    assert budget.elapsed < limit + 2  # on a busy machine


@pytest.mark.parametrize("stage", ["start", "guide", "sequence"])
def test_a_cancel_is_heard_in_every_stage(
    hyq_data: RobotData, flat_scene: Scene, stage: str
) -> None:
    now: list[str] = [""]

    def follow(progress: Progress) -> None:
        now[0] = progress.stage

    budget = Budget(cancelled=lambda: now[0] == stage, report=follow)
    with pytest.raises(Cancelled) as caught:
        plan(walk_to(1.0), hyq_data, flat_scene, budget)
    assert caught.value.stage == stage


@pytest.mark.parametrize(("end", "error"), [("start", StartUnreachable), ("goal", GoalUnreachable)])
@pytest.mark.parametrize(
    ("position", "limb", "cause"),
    [
        ((1.5, 0, 2.5), "lf_leg", Cause.NO_SURFACE_IN_WORKSPACE),
        ((1.5, 0, 0.1), "", Cause.TRUNK_COLLISION),
        ((-3.0, 0, 1.0), "", Cause.TRUNK_IN_OBSTACLE),
        ((3.55, 0, 0.6), "lf_leg", Cause.NO_SURFACE_IN_WORKSPACE),
    ],
)
def test_an_end_that_cannot_be(
    hyq_data: RobotData,
    make_box: Box,
    end: str,
    error: type[StartUnreachable],
    position: tuple[float, float, float],
    limb: str,
    cause: Cause,
) -> None:
    block = make_box("block", np.array([-4.5, -1.5, 0.0]), np.array([-1.5, 1.5, 2.0]))
    scene = Scene([island("ground", -5.0, 3.4), *block])
    with pytest.raises(error) as caught:
        plan(walk_to(1.0, **{end: Placement.parse(position)}), hyq_data, scene, Budget(60.0))
    assert (caught.value.failure.cause, caught.value.limb) == (cause, limb)
    assert f"the {end} is not reachable" in str(caught.value)


@pytest.mark.parametrize("end", ["start", "goal"])
@pytest.mark.parametrize(
    ("pose", "reason"),
    [
        (Placement.parse((9, 0, 0.6)), "x = 9 m is outside"),
        (Placement.parse((0, 0, 3.5)), "z = 3.5 m is outside"),
        (Placement.parse((0, 0, 0.6), (0, 0, 1, 0)), "yaw"),
        (Placement.parse((0, 0, 0.6), (np.sin(0.2), 0, 0, np.cos(0.2))), "roll"),
    ],
)
def test_an_end_out_of_bounds_is_bad_input(
    hyq_data: RobotData, flat_scene: Scene, end: str, pose: Placement, reason: str
) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        plan(walk_to(1.0, **{end: pose}), hyq_data, flat_scene, Budget(60.0))
    assert caught.value.field == end
    assert caught.value.value == [*pose.position, *pose.orientation]


def test_more_robustness_than_there_is(hyq_data: RobotData, flat_scene: Scene) -> None:
    with pytest.raises(StartUnreachable) as caught:
        plan(walk_to(1.0, robustness_threshold=1e4), hyq_data, flat_scene, Budget(60.0))
    assert caught.value.failure.cause == Cause.NO_EQUILIBRIUM
    assert caught.value.limb in LEGS


def test_no_guide_over_a_gap(hyq_data: RobotData) -> None:
    scene = Scene([island("a", -2, 1), island("b", 3, 5)])
    request = walk_to(4.0, options=FEW)
    with pytest.raises(NoGuideFound) as caught:
        plan(request, hyq_data, scene, Budget(60.0))
    assert caught.value.failure.cause == Cause.TREES_NOT_CONNECTED
    assert caught.value.failure.figure("samples") == 40


def test_no_sequence_where_only_the_left_feet_find_ground(hyq_data: RobotData) -> None:
    ring = [[0.5, 0.3, 0], [4.5, 0.3, 0], [4.5, 0.5, 0], [0.5, 0.5, 0]]
    bridge = make_surface("bridge", ring, 0.5)
    scene = Scene([island("a", -2, 1.5), island("b", 3.5, 6), bridge])
    low, high = np.array([-1.0, -0.1, 0.3]), np.array([5.0, 0.1, 1])
    request = walk_to(
        4.5,
        options=FEW,
        required_limbs=(LEGS[0], LEGS[2]),
        bounds=RootBounds(low, high, np.ones(3)),
    )
    with pytest.raises(NoSequenceFound) as caught:
        plan(request, hyq_data, scene, Budget(60.0))
    error = caught.value
    assert 0 < error.fraction < 1
    assert error.limb in ("", *LEGS)
    assert error.states[0].q[:3] == pytest.approx([0, 0, 0.6])
    assert error.states[-1].q[0] == pytest.approx(4.5 * error.fraction, abs=0.3)
    assert f"stopped after state {len(error.states) - 1}" in str(error)


def test_one_time_limit_holds_for_all_guides(hyq_data: RobotData) -> None:
    """As above: guides are tried until the limit, and the best of them is reported."""
    ring = [[0.5, 0.3, 0], [4.5, 0.3, 0], [4.5, 0.5, 0], [0.5, 0.5, 0]]
    bridge = make_surface("bridge", ring, 0.5)
    scene = Scene([island("a", -2, 1.5), island("b", 3.5, 6), bridge])
    low, high = np.array([-1.0, -0.1, 0.3]), np.array([5.0, 0.1, 1])
    guide = GuideOptions(rrt=RrtOptions(iterations=40))
    request = walk_to(
        4.5,
        options=PlannerOptions(guide=guide),
        required_limbs=(LEGS[0], LEGS[2]),
        bounds=RootBounds(low, high, np.ones(3)),
    )
    for limit in (1.5, 6.0, 24.0):  # seconds, until the machine has time for one guide
        budget = Budget(limit)
        with pytest.raises(TimeLimitReached) as caught:
            plan(request, hyq_data, scene, budget)
        if caught.value.best is not None:
            break
    assert caught.value.statistics.counts["guides"] >= 1
    assert caught.value.best is not None
    assert caught.value.states == caught.value.best.states
    assert caught.value.fraction > 0
    assert limit < budget.elapsed < limit + 2.0  # on a busy machine


def attempts(
    monkeypatch: pytest.MonkeyPatch, found: Callable[[int], bool]
) -> tuple[list[int], list[str]]:
    """Attempts that all fail, with a guide where `found` says so; and what was tried, by name."""
    tried: list[int] = []
    ends: list[str] = []

    def guide(self: object, direct: bool) -> GuidePath:
        tried.append(len(tried))
        assert direct == (tried == [0])
        if not found(tried[-1]):
            raise NoGuideFound(NO_GUIDE)
        return GuidePath(np.array([[0, 0, 0.6, 0, 0, 0, 1], [1, 0, 0.6, 0, 0, 0, 1.0]]))

    def stop(*_: object) -> NoReturn:
        raise ended(NoSequenceFound(1, NO_WAY, 0.5), 0.5, 2)

    def end(
        generator: ContactGenerator,
        root: Array,
        limbs: list[int],
        which: str = "start",
        budget: Budget | None = None,
    ) -> State:
        ends.append(which)
        return start_state(generator, root, limbs, which, budget)

    monkeypatch.setattr("rbprm_core.planner._Pipeline._guide", guide)
    monkeypatch.setattr(f"{ALONG_GUIDE}.plan_sequence", stop)
    monkeypatch.setattr(f"{ALONG_GUIDE}.start_state", end)
    return tried, ends


def test_guides_not_found_after_one_that_was_are_attempts_like_others(
    hyq_data: RobotData, flat_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried, _ = attempts(monkeypatch, lambda attempt: attempt % 3 == 0)
    request = walk_to(1.0, options=PlannerOptions(guides=50))
    with pytest.raises(NoSequenceFound):
        plan(request, hyq_data, flat_scene, Budget(60.0))
    assert len(tried) == 50


def test_no_guide_at_all_is_told_at_once(
    hyq_data: RobotData, flat_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried, _ = attempts(monkeypatch, lambda attempt: False)
    with pytest.raises(NoGuideFound):
        plan(walk_to(1.0), hyq_data, flat_scene, Budget(60.0))
    assert len(tried) == 1


@pytest.mark.parametrize(("guides", "before"), [(3, 3), (20, 20), (30, 20)])
def test_the_goal_is_tried_once_after_some_attempts(
    hyq_data: RobotData,
    flat_scene: Scene,
    monkeypatch: pytest.MonkeyPatch,
    guides: int,
    before: int,
) -> None:
    options = PlannerOptions(guides=guides)
    tried, ends = attempts(monkeypatch, lambda attempt: True)
    with pytest.raises(NoSequenceFound):  # it admits what the request requires
        plan(walk_to(1.0, options=options, goal_limbs=LEGS), hyq_data, flat_scene, Budget(60.0))
    assert ends == ["start", "goal"]
    tried.clear()
    edge = Scene([island("ground", -2, 1)])
    request = walk_to(1.2, options=options, required_limbs=LEGS[2:], goal_limbs=LEGS)
    with pytest.raises(GoalUnreachable) as caught:
        plan(request, hyq_data, edge, Budget(60.0))
    assert len(tried) == before
    assert len(caught.value.states) == 2


@pytest.mark.parametrize(
    ("cause", "kind"),
    [
        (Cause.NO_CANDIDATE, GoalUnreachable),
        (Cause.NO_EQUILIBRIUM, GoalUnreachable),
        (Cause.NO_KINEMATIC_SOLUTION, NoSequenceFound),
        (Cause.REFERENCE_POSTURE_COLLISION, NoSequenceFound),
    ],
)
def test_a_goal_that_another_posture_may_reach_is_not_refused(
    hyq_data: RobotData,
    flat_scene: Scene,
    monkeypatch: pytest.MonkeyPatch,
    cause: Cause,
    kind: type[RbprmError],
) -> None:
    attempts(monkeypatch, lambda attempt: True)

    def refuse(*arguments: Any, **options: Any) -> State:
        if "goal" in map(str, arguments):
            raise GoalUnreachable(Failure.of(cause, "lf_leg"))
        return start_state(*arguments, **options)

    monkeypatch.setattr(f"{ALONG_GUIDE}.start_state", refuse)
    request = walk_to(1.0, options=PlannerOptions(guides=3), goal_limbs=LEGS)
    with pytest.raises(kind):
        plan(request, hyq_data, flat_scene, Budget(60.0))


def test_roots_avoided_are_forgotten_where_they_close_the_way(hyq_data: RobotData) -> None:
    scene = Scene([island("ground", -2, 4)])
    reachability = Reachability(hyq_data, scene, LEGS)
    start, stopped, goal = (walk_to(x).goal for x in (0.0, 1.0, 2.0))
    roots = [np.array([*at.position, *at.orientation]) for at in (start, stopped, goal)]
    reachability.avoid(roots[1], keep=(roots[0], roots[2]))
    assert not reachability.holds(roots[1])
    reachability.forget()
    assert reachability.holds(roots[1])


def test_a_goal_on_two_legs_is_not_reachable(hyq_data: RobotData) -> None:
    scene = Scene([island("ground", -2, 1)])
    request = walk_to(1.2, options=FEW, required_limbs=LEGS[2:])
    with pytest.raises(GoalUnreachable) as caught:
        plan(replace(request, goal_limbs=LEGS), hyq_data, scene, Budget(60.0))
    assert caught.value.failure == Failure.of(Cause.NO_CANDIDATE, "lf_leg")
    with pytest.raises(NoSequenceFound) as stopped:  # any limbs may do; it cannot know which
        plan(request, hyq_data, scene, Budget(60.0))
    assert len(caught.value.states) == len(stopped.value.states) > 1
    assert caught.value.fraction == stopped.value.fraction > 0


@pytest.mark.parametrize("kind", [TimeLimitReached, Cancelled])
def test_an_end_while_the_goal_is_tried_keeps_what_the_guides_gave(
    hyq_data: RobotData, kind: type[RbprmError]
) -> None:
    scene = Scene([island("ground", -2, 1)])
    request = walk_to(1.2, options=FEW, required_limbs=LEGS[2:], goal_limbs=LEGS)
    stages: list[str] = []

    def follow(progress: Progress) -> None:
        stages.append(progress.stage)
        if tries_the_goal() and kind is TimeLimitReached:
            budget.time_limit = 1e-3

    def tries_the_goal() -> bool:
        return "sequence" in stages and stages[-1] == "start"

    budget = Budget(60.0, lambda: kind is Cancelled and tries_the_goal(), follow)
    with pytest.raises(kind, match="stage start") as caught:
        plan(request, hyq_data, scene, budget)
    assert len(caught.value.states) > 1
    assert caught.value.fraction > 0
    if isinstance(caught.value, TimeLimitReached):
        assert caught.value.best is not None
        assert caught.value.best.states == caught.value.states


def ended(error: RbprmError, fraction: float, states: int) -> RbprmError:
    """How an attempt ended, with the share of its guide that its states cover."""
    error.fraction, error.states = fraction, tuple(range(states))
    return error


@pytest.mark.parametrize(
    ("fraction", "states", "kept"),
    [(0.3, 9, 5), (0.7, 2, 2), (0.5, 9, 5), (0.0, 0, 5)],
    ids=["less far with more states", "farther with fewer", "as far", "not begun"],
)
@pytest.mark.parametrize("kind", [TimeLimitReached, Cancelled])
def test_the_states_are_of_the_attempt_that_came_farthest(
    hyq_data: RobotData,
    flat_scene: Scene,
    monkeypatch: pytest.MonkeyPatch,
    kind: type[RbprmError],
    fraction: float,
    states: int,
    kept: int,
) -> None:
    best = ended(NoSequenceFound(4, NO_WAY, 0.5), 0.5, 5)
    last = Cancelled("sequence") if kind is Cancelled else TimeLimitReached(60.0, "sequence")
    ends = iter([best, ended(last, fraction, states)])

    def attempt(*_: object) -> NoReturn:
        raise next(ends)

    monkeypatch.setattr(f"{ALONG_GUIDE}.plan_sequence", attempt)
    with pytest.raises(kind) as caught:
        plan(walk_to(1.0), hyq_data, flat_scene, Budget(60.0))
    assert len(caught.value.states) == kept
    assert caught.value.fraction == max(fraction, 0.5)
    if isinstance(caught.value, TimeLimitReached):
        assert caught.value.best is best


def test_no_limb_is_required(hyq_data: RobotData, flat_scene: Scene) -> None:
    request = walk_to(1.0, required_limbs=())
    outcome = plan(request, hyq_data, flat_scene, Budget(60.0))
    assert_clean(contact_plan(outcome, request, hyq_data.robot, GROUND))


def test_a_limb_that_need_not_reach_is_free_to(hyq_data: RobotData, flat_scene: Scene) -> None:
    request = walk_to(0.6, required_limbs=LEGS[:3], start_limbs=LEGS[:3])
    outcome = plan(request, hyq_data, flat_scene, Budget(60.0))
    assert [contact.limb for contact in outcome.states[0].contacts] == [0, 1, 2]
    assert_clean(contact_plan(outcome, request, hyq_data.robot, GROUND))


def test_a_mesh_may_be_moved_with_start_and_goal(hyq_data: RobotData) -> None:
    text = load_scenario("flat")
    shift = (10.0, -3.0, 2.0)
    mesh = MeshEntry(**{**text.environment.meshes[0].model_dump(), "translation": shift})
    moved = EnvironmentEntry(name="moved", meshes=(mesh,))
    request = text.request_for(hyq_data.robot, 0)
    ends = [Placement.parse(p.position + shift) for p in (request.start, request.goal)]
    bounds = replace(
        request.bounds, low=request.bounds.low + shift, high=request.bounds.high + shift
    )
    request = replace(request, start=ends[0], goal=ends[1], bounds=bounds)
    scene = text.model_copy(
        update={"environment": text.environment.model_copy(update={"meshes": (mesh,)})}
    ).scene()
    outcome = plan(request, hyq_data, scene, Budget(60.0))
    assert_clean(contact_plan(outcome, request, hyq_data.robot, moved))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"start_limbs": ("lf_leg", *LEGS)}, "start_limbs.1"),
        ({"required_limbs": ("lf_leg", "lf_leg")}, "required_limbs.1"),
        ({"required_limbs": ("wing",)}, "required_limbs.0"),
        ({"goal_limbs": ("wing",)}, "goal_limbs.0"),
        ({"goal_limbs": ("lf_leg", "lf_leg")}, "goal_limbs.1"),
        ({"robustness_threshold": -1.0}, "robustness_threshold"),
        ({"robustness_threshold": float("nan")}, "robustness_threshold"),
        ({"seed": -1}, "seed"),
    ],
)
def test_a_request_made_by_hand_is_checked_too(
    hyq_data: RobotData, flat_scene: Scene, changes: dict[str, Any], field: str
) -> None:
    with pytest.raises(InvalidInput) as caught:
        plan(walk_to(1.0, **changes), hyq_data, flat_scene, Budget(10.0))
    assert caught.value.field == field


def test_a_later_guide_that_is_not_found_does_not_hide_how_far_one_came(
    hyq_data: RobotData,
) -> None:
    gap = Scene([island("here", -2, 0.6), island("there", 2.0, 5)])
    guide = GuideOptions(rrt=RrtOptions(iterations=2))
    request = walk_to(3.0, required_limbs=(), options=replace(FEW, guide=guide))
    with pytest.raises(NoSequenceFound) as caught:
        plan(request, hyq_data, gap, Budget(60.0))
    assert 0 < caught.value.fraction < 1
