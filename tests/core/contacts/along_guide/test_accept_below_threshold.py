"""The most robust configuration where none reaches the threshold: on request only, and said."""

from __future__ import annotations

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.check import Kind, check_plan
from rbprm_core.contacts.along_guide import ContactGenerator, start_state
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.errors import StartUnreachable
from rbprm_core.failures import Cause
from rbprm_core.guide.root import RootBounds
from rbprm_core.outcome import Outcome
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import EnvironmentEntry, SurfaceEntry
from rbprm_core.planner import plan
from rbprm_core.request import PlannerOptions, PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

GRAVITY = np.array([0.0, 0.0, -9.81])
ACCEPT_BELOW_THRESHOLD = GeneratorOptions(accept_below_threshold=True)
START = np.array([0.0, 0.0, 0.42, 0.0, 0.0, 0.0, 1.0, 0.0])  # of the toy robot, waist included
FEET = [0, 1, 2, 3]


def generator(
    data: RobotData, scene: Scene, threshold: float, accept_below_threshold: bool
) -> ContactGenerator:
    options = GeneratorOptions(accept_below_threshold=accept_below_threshold)
    return ContactGenerator(data, scene, GRAVITY, threshold, options)


def test_the_generator_takes_the_most_robust_over_the_fallback(
    toy_data: RobotData, flat_scene: Scene
) -> None:
    able = generator(toy_data, flat_scene, 0.0, accept_below_threshold=False)
    first = start_state(able, START, FEET)
    others = [contact for contact in first.contacts if contact.limb != 0]
    still = LookAhead.still(START)
    reached = able.generate(first.q, 0, others, still)
    assert not isinstance(reached, Cause)
    unreachable = 1e3
    assert (
        able.generate(first.q, 0, others, still, min_robustness=unreachable) == Cause.NO_EQUILIBRIUM
    )
    best = able.generate(first.q, 0, others, still, min_robustness=unreachable, fallback=0.0)
    assert not isinstance(best, Cause)
    assert best.robustness == pytest.approx(able.body.robustness(best.q, [*others, best.contact]))
    assert reached.robustness <= best.robustness < unreachable
    assert able.generate(first.q, 0, others, still, min_robustness=unreachable, fallback=900.0) == (
        Cause.NO_EQUILIBRIUM
    )


def test_a_threshold_that_is_reached_is_not_given_up(
    toy_data: RobotData, flat_scene: Scene
) -> None:
    states = [
        start_state(generator(toy_data, flat_scene, 5.0, asked), START, FEET)
        for asked in (False, True)
    ]
    assert (states[0].q == states[1].q).all()


def test_the_start_state_on_request_only(toy_data: RobotData, flat_scene: Scene) -> None:
    with pytest.raises(StartUnreachable) as caught:
        start_state(generator(toy_data, flat_scene, 1e3, accept_below_threshold=False), START, FEET)
    assert caught.value.failure.cause == Cause.NO_EQUILIBRIUM
    able = generator(toy_data, flat_scene, 1e3, accept_below_threshold=True)
    assert able.fallback_robustness == 0.0
    state = start_state(able, START, FEET)
    assert 0 <= state.robustness < 1e3
    assert state.robustness == pytest.approx(able.body.robustness(state.q, state.contacts))


@pytest.fixture(scope="module")
def weak(toy_data: RobotData, flat_scene: Scene) -> tuple[PlanRequest, Outcome]:
    """A walk whose threshold the start reaches, and not all of the way."""
    standing = start_state(
        generator(toy_data, flat_scene, 1e3, accept_below_threshold=True), START, FEET
    )
    limbs = tuple(limb.name for limb in toy_data.robot.limbs)
    request = PlanRequest(
        start=Placement.parse([0.0, 0.0, 0.42]),
        goal=Placement.parse([0.5, 0.0, 0.42]),
        bounds=RootBounds(np.array([-1, -1, 0.2]), np.array([1, 1, 0.6]), np.full(3, 0.2)),
        required_limbs=limbs,
        start_limbs=limbs,
        robustness_threshold=0.99 * standing.robustness,
        options=PlannerOptions(guides=1, generator=ACCEPT_BELOW_THRESHOLD),
    )
    return request, plan(request, toy_data, flat_scene, Budget(60.0))


def test_the_plan_states_the_truth_and_the_check_reports_it(
    weak: tuple[PlanRequest, Outcome], toy_data: RobotData, flat_scene: Scene
) -> None:
    request, outcome = weak
    ground = flat_scene.surfaces[0]
    vertices = tuple(tuple(corner) for corner in ground.polygon.boundary.tolist())
    entry = EnvironmentEntry(name="flat", surfaces=(SurfaceEntry(id=ground.id, vertices=vertices),))
    found = contact_plan(outcome, request, toy_data.robot, entry)
    report = check_plan(found)
    declared = [state.robustness for state in found.states]
    assert report.robustness == pytest.approx(declared, abs=0.1)
    under = {k for k, value in enumerate(declared) if value < request.robustness_threshold}
    assert under
    assert len(under) < len(declared)
    assert {(v.state, v.kind) for v in report.violations} == {(k, Kind.STATICS) for k in under}
    assert min(declared) >= 0
