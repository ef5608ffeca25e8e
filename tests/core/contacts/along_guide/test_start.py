"""The contact state at a given root."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide import ContactGenerator, start_state
from rbprm_core.contacts.along_guide.start import _in_order
from rbprm_core.errors import GoalUnreachable, RootUnreachable, StartUnreachable
from rbprm_core.failures import Cause, Failure
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario
from rbprm_core.scene import Scene, Surface, make_surface

Array = NDArray[np.float64]
Box = Callable[..., list[Surface]]
GRAVITY = np.array([0.0, 0.0, -9.81])
ROOT = np.array([0.0, 0, 0.6, 0, 0, 0, 1])
LEGS = (0, 1, 2, 3)


def on(data: RobotData, surfaces: list[Surface], threshold: float = 5.0) -> ContactGenerator:
    return ContactGenerator(data, Scene(surfaces), GRAVITY, threshold)


def ground(low: float = -5.0, high: float = 5.0, friction: float = 0.5) -> Surface:
    ring = [[low, -5, 0], [high, -5, 0], [high, 5, 0], [low, 5, 0]]
    return make_surface("ground", ring, friction)


@pytest.mark.parametrize("limbs", [LEGS, (3, 2, 1, 0), (0, 1, 2)])
def test_a_start_on_flat_ground(hyq_data: RobotData, limbs: tuple[int, ...]) -> None:
    generator = on(hyq_data, [ground()])
    state = start_state(generator, ROOT, limbs)
    assert np.array_equal(state.q[:7], ROOT)
    assert tuple(contact.limb for contact in state.contacts) == limbs
    assert state.free == tuple(k for k in LEGS if k not in limbs)
    assert state.robustness >= 5.0
    assert generator.body.collision.root_free(state.q)
    for limb in LEGS:
        contact = state.contact_of(limb)
        normal = None if contact is None else contact.normal
        assert generator.body.collision.limb_free(state.q, limb, normal)


def test_twice_the_same(hyq_data: RobotData) -> None:
    states = [start_state(on(hyq_data, [ground()]), ROOT, LEGS) for _ in range(2)]
    assert np.array_equal(states[0].q, states[1].q)


def test_the_root_part_in_an_obstacle(hyq_data: RobotData, make_box: Box) -> None:
    pillar = make_box("b", np.array([-0.1, -0.1, 0.3]), np.array([0.1, 0.1, 0.9]))
    with pytest.raises(StartUnreachable) as caught:
        start_state(on(hyq_data, [ground(), *pillar]), ROOT, LEGS)
    assert caught.value.failure == Failure.of(Cause.ROOT_COLLISION)


@pytest.mark.parametrize(
    ("which", "kind"), [("start", StartUnreachable), ("goal", GoalUnreachable)]
)
def test_a_limb_over_nothing_is_named(
    hyq_data: RobotData, which: str, kind: type[RootUnreachable]
) -> None:
    behind = on(hyq_data, [ground(-5.0, -0.1)])
    with pytest.raises(kind) as caught:
        start_state(behind, ROOT, (2, 3, 0, 1), which)
    assert caught.value.which == which
    assert caught.value.failure == Failure.of(Cause.NO_CANDIDATE, "lf_leg")


def test_too_much_is_asked_of_the_whole_stance(hyq_data: RobotData) -> None:
    with pytest.raises(StartUnreachable) as caught:
        start_state(on(hyq_data, [ground()], threshold=1e4), ROOT, LEGS)
    # The last limb, with which the stance is whole.
    assert caught.value.failure == Failure.of(Cause.NO_EQUILIBRIUM, "rh_leg")


def test_two_feet_do_not_hold_it(hyq_data: RobotData) -> None:
    with pytest.raises(StartUnreachable) as caught:
        start_state(on(hyq_data, [ground()]), ROOT, (0, 1))
    assert caught.value.failure.cause == Cause.NO_EQUILIBRIUM


def test_a_free_limb_in_an_obstacle(hyq_data: RobotData, make_box: Box) -> None:
    low = ROOT.copy()
    low[2] = 0.5  # under the reference height: a foot that finds no contact is in the ground
    with pytest.raises(StartUnreachable) as caught:
        start_state(on(hyq_data, [ground()], threshold=-1e3), low, (0, 1, 2))
    assert caught.value.failure == Failure.of(Cause.REFERENCE_POSTURE_COLLISION, "rh_leg")


def test_a_start_on_no_limb_is_no_start(hyq_data: RobotData) -> None:
    with pytest.raises(StartUnreachable) as caught:
        start_state(on(hyq_data, [ground()]), ROOT, ())
    assert caught.value.failure == Failure.of(Cause.NO_START_LIMBS)


def test_another_order_where_the_one_given_leads_nowhere(
    hyq_data: RobotData, rubble: Scenario, rubble_scene: Scene
) -> None:
    """Over the rubble every order fails at some roots, mostly not all of them at the same."""
    rng = np.random.default_rng(5)
    generator = ContactGenerator(hyq_data, rubble_scene, GRAVITY, 10.0)
    saved = 0
    for _ in range(100):
        root = ROOT.copy()
        root[:3] = rng.uniform([-2, -0.1, 0.53], [3, 0.1, 0.73])
        q = generator.robot.reference.copy()
        q[:7] = root
        alone = outcome(lambda q=q: _in_order(generator, q, LEGS, 10.0, StartUnreachable))
        found = outcome(lambda root=root: start_state(generator, root, LEGS))
        if isinstance(found, StartUnreachable):
            assert isinstance(alone, StartUnreachable)
            assert found.failure == alone.failure  # that of the order given
            continue
        if isinstance(alone, State):
            assert np.array_equal(found.q, alone.q)  # the order given comes first
        else:
            saved += 1
        assert tuple(contact.limb for contact in found.contacts) == LEGS  # the oldest first
        assert generator.body.robustness(found.q, found.contacts) >= 10.0
        for contact in found.contacts:
            assert generator.body.collision.limb_free(found.q, contact.limb, contact.normal)
    assert saved > 0


def outcome(find: Callable[[], State]) -> State | StartUnreachable:
    """What a call gives, or its error."""
    try:
        return find()
    except StartUnreachable as error:
        return error
