"""The contact generator: what it makes is a contact, and what it refuses has a cause."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact
from rbprm_core.contacts.along_guide import ContactGenerator, start_state
from rbprm_core.contacts.along_guide.generator import COM_MARGIN, Placed
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.contacts.along_guide.walk_state import WalkState
from rbprm_core.errors import InvalidInput
from rbprm_core.failures import Cause
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

Array = NDArray[np.float64]
Box = Callable[..., list[Surface]]
GRAVITY = np.array([0.0, 0.0, -9.81])
LEGS = (0, 1, 2, 3)
STONE, PITCH = 0.1, 0.15  # metres


def root_at(x: float, y: float, z: float, yaw: float = 0.0) -> Array:
    return np.concatenate([[x, y, z], pin.Quaternion(pin.exp3(np.array([0, 0, yaw]))).coeffs()])


def placed(robot: Robot, root: Array) -> Array:
    q = robot.reference.copy()
    q[robot.root_index] = root
    return q


def foot(robot: Robot, q: Array, limb: int) -> Array:
    """Centre of a foot's ball in the world."""
    data, this = robot.model.createData(), robot.limbs[limb]
    pin.framesForwardKinematics(robot.model, data, q)
    return np.asarray(data.oMf[this.frame].act(this.contact.translation)).copy()


def standing(generator: ContactGenerator, root: Array) -> WalkState:
    return start_state(generator, root, LEGS)


@pytest.fixture(scope="module")
def flat(hyq_data: RobotData, flat_scene: Scene) -> ContactGenerator:
    return ContactGenerator(hyq_data, flat_scene, GRAVITY, 10.0)


@pytest.fixture(scope="module")
def tilted(hyq_data: RobotData) -> ContactGenerator:
    """Four slopes, one to each quarter of the ground, and a margin at their edges."""
    surfaces = []
    for k, (sx, sy) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)]):
        ring = np.array([[0, 0], [sx, 0], [sx, sy], [0, sy]])[:: 1 if sx * sy > 0 else -1]
        heights = 0.1 * np.abs(ring).sum(axis=1)
        surfaces.append(make_surface(f"q{k}", np.column_stack([1.2 * ring, heights]), 0.6))
    return ContactGenerator(
        hyq_data, Scene(surfaces), GRAVITY, 1.0, GeneratorOptions(edge_margin=0.03)
    )


@pytest.fixture(scope="module")
def stones(hyq_data: RobotData) -> ContactGenerator:
    """Stepping stones, the width of their middle part no more than that of the gaps."""
    square = STONE / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    surfaces = [
        make_surface(f"{i}_{k}", square + PITCH * np.array([i, k, 0]), 0.5)
        for i in range(-8, 9)
        for k in range(-8, 9)
    ]
    return ContactGenerator(
        hyq_data, Scene(surfaces), GRAVITY, 0.0, GeneratorOptions(edge_margin=0.03)
    )


@settings(max_examples=40)
@given(
    x=st.floats(-0.25, 0.25), y=st.floats(-0.2, 0.2), z=st.floats(0.55, 0.75),
    yaw=st.floats(-0.5, 0.5), limb=st.integers(0, 3),
)  # fmt: skip
def test_a_contact_is_on_its_surface_and_the_limb_on_the_contact(
    tilted: ContactGenerator, x: float, y: float, z: float, yaw: float, limb: int
) -> None:
    robot, scene = tilted.robot, tilted.body.scene
    root = root_at(x, y, z, yaw)
    q = placed(robot, root)
    before = q.copy()
    found = tilted.generate(q, limb, [], LookAhead.still(root), min_robustness=-np.inf)
    assert np.array_equal(q, before)
    assert isinstance(found, Placed)
    moved, contact = found.q, found.contact
    index = robot.limbs[limb].q_index
    others = np.setdiff1d(np.arange(len(q)), index)
    assert np.array_equal(moved[others], q[others])
    assert (moved[index] >= robot.low[index]).all()
    assert (moved[index] <= robot.high[index]).all()
    assert contact.limb == limb
    surface = scene.surfaces[scene.index[contact.surface]]
    assert contact.friction == surface.friction == 0.6
    assert contact.normal == pytest.approx(surface.normal)
    assert contact.rotation.T @ contact.rotation == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(contact.rotation) == pytest.approx(1)
    off = (contact.position - surface.polygon.plane.origin) @ surface.normal
    assert off == pytest.approx(0, abs=1e-6)
    edges = np.roll(surface.polygon.boundary, -1, axis=0) - surface.polygon.boundary
    inward = np.cross(surface.normal, edges)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    depth = ((contact.position - surface.polygon.boundary) * inward).sum(axis=1)
    # A sample is inside by the margin; the foot of its perpendicular, on the plane, is too.
    assert depth.min() >= 0.03 - 1e-9
    centre = contact.position + robot.limbs[limb].radius * contact.normal
    assert foot(robot, moved, limb) == pytest.approx(centre, abs=1e-4)
    assert tilted.body.collision.limb_free(moved, limb, contact.normal)


@settings(max_examples=60)
@given(x=st.floats(-0.3, 0.3), y=st.floats(-0.3, 0.3), limb=st.integers(0, 3))
def test_a_contact_keeps_off_the_edges_of_a_stepping_stone(
    stones: ContactGenerator, x: float, y: float, limb: int
) -> None:
    root = root_at(x, y, 0.6)
    q = placed(stones.robot, root)
    found = stones.generate(q, limb, [], LookAhead.still(root), min_robustness=-np.inf)
    assert isinstance(found, Placed)
    offset = (found.contact.position[:2] + STONE / 2) % PITCH - STONE / 2
    assert np.abs(offset).max() <= STONE / 2 - 0.03 + 1e-6


def test_what_is_made_is_robust_enough(flat: ContactGenerator) -> None:
    root = root_at(0, 0, 0.6)
    state = standing(flat, root)
    for limb in LEGS:
        others = [c for c in state.contacts if c.limb != limb]
        found = flat.generate(state.q, limb, others, LookAhead.still(root))
        assert isinstance(found, Placed)
        assert found.robustness >= 10.0
        held = [*others, found.contact]
        assert found.robustness == pytest.approx(flat.body.robustness(found.q, held))


def test_a_moved_contact_is_somewhere_else(flat: ContactGenerator) -> None:
    root = root_at(0, 0, 0.6)
    state = standing(flat, root)
    for old in state.contacts:
        others = [c for c in state.contacts if c is not old]
        found = flat.generate(state.q, old.limb, others, LookAhead.still(root), replaced=old)
        assert isinstance(found, Placed)
        assert np.linalg.norm(found.contact.position - old.position) > 0.015


def test_causes(flat: ContactGenerator, hyq_data: RobotData, make_box: Box) -> None:
    high = root_at(0, 0, 5)
    assert (
        flat.generate(placed(flat.robot, high), 0, [], LookAhead.still(high)) == Cause.NO_CANDIDATE
    )
    root = root_at(0, 0, 0.6)
    still = LookAhead.still(root)
    assert flat.generate(placed(flat.robot, root), 0, [], still) == Cause.NO_EQUILIBRIUM
    state = standing(flat, root)
    others = list(state.contacts[1:])
    assert flat.generate(state.q, 0, others, still, min_robustness=1e6) == Cause.NO_EQUILIBRIUM
    low = make_box("lid", np.array([-2, -2, 0.02]), np.array([2, 2, 0.4]))
    ground = make_surface("g", [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], 0.5)
    lid = [face for face in low if face.normal[2] < 0.5]  # no top to stand on
    covered = ContactGenerator(hyq_data, Scene([ground, *lid]), GRAVITY, 0.0)
    assert (
        covered.generate(placed(covered.robot, root), 0, [], still) == Cause.NO_KINEMATIC_SOLUTION
    )


def test_a_kept_contact_stays_where_it_is(flat: ContactGenerator) -> None:
    robot = flat.robot
    state = standing(flat, root_at(0, 0, 0.6))
    for shift in (0.02, -0.02):
        q = state.q.copy()
        q[0] += shift
        for contact in state.contacts:
            moved = flat.body.project(q, contact)
            assert moved is not None
            centre = contact.position + robot.limbs[contact.limb].radius * contact.normal
            assert foot(robot, moved, contact.limb) == pytest.approx(centre, abs=1e-4)
            index = robot.limbs[contact.limb].q_index
            assert (moved[index] >= robot.low[index]).all()
            assert (moved[index] <= robot.high[index]).all()
            q = moved
    far = state.q.copy()
    far[0] += 2.0
    assert all(flat.body.project(far, contact) is None for contact in state.contacts)


def test_a_resting_limb_is_free(flat: ContactGenerator) -> None:
    robot = flat.robot
    rng = np.random.default_rng(0)
    q = placed(robot, root_at(0, 0, 0.45))  # the feet of the reference posture are in the ground
    assert not flat.body.collision.limb_free(q, 0, None)
    rested = flat.rest(q, 0, rng)
    assert rested is not None
    assert flat.body.collision.limb_free(rested, 0, None)
    others = np.setdiff1d(np.arange(len(q)), robot.limbs[0].q_index)
    assert np.array_equal(rested[others], q[others])
    again = flat.rest(rested, 0, rng)
    assert again is not None
    assert np.array_equal(again, rested)


def test_the_robustness_is_of_all_contacts_together(flat: ContactGenerator) -> None:
    state = standing(flat, root_at(0, 0, 0.6))
    assert flat.body.robustness(state.q, state.contacts) == pytest.approx(state.robustness)
    assert flat.body.robustness(state.q, state.contacts[:1]) < 0
    assert flat.body.robustness(state.q, []) == -np.inf
    assert flat.body.com(state.q) == pytest.approx(state.com)
    assert np.abs(state.com[:2] - state.q[:2]).max() < 0.1


def test_limbs_keep_to_their_surfaces(hyq_data: RobotData) -> None:
    wall = make_surface("w", [[-2, 0.35, -2], [-2, 0.35, 2], [2, 0.35, 2], [2, 0.35, -2]], 0.5)
    generator = ContactGenerator(hyq_data, Scene([wall]), GRAVITY, 0.0)
    root = root_at(0, 0, 0.6)
    found = generator.generate(placed(generator.robot, root), 0, [], LookAhead.still(root))
    assert found == Cause.NO_CANDIDATE


def test_an_unknown_heuristic_is_bad_input(hyq_data: RobotData, flat_scene: Scene) -> None:
    text = hyq_data.robot.description
    limbs = (text.limbs[0].model_copy(update={"heuristics": {"luck": 1.0}}), *text.limbs[1:])
    robot = Robot.load(text.model_copy(update={"limbs": limbs}))
    data = RobotData(**{**vars(hyq_data), "robot": robot})
    with pytest.raises(InvalidInput, match="unknown heuristic") as caught:
        ContactGenerator(data, flat_scene, GRAVITY, 0.0)
    assert (caught.value.field, caught.value.value) == ("limbs.lf_leg.heuristics", "luck")


def test_a_state_knows_its_contacts(flat: ContactGenerator) -> None:
    state = standing(flat, root_at(0, 0, 0.6))
    for limb in LEGS:
        contact = state.contact_of(limb)
        assert isinstance(contact, Contact)
        assert contact.limb == limb
    assert flat.state(state.q, state.contacts[1:], [0], 1.0).contact_of(0) is None


@pytest.mark.parametrize(
    ("which", "height", "limbs"), [("hyq_data", 0.6, LEGS), ("crawler_data", 1.0, (0, 1))]
)
def test_a_hopeless_candidate_would_have_failed(
    which: str, height: float, limbs: tuple[int, ...], request: pytest.FixtureRequest
) -> None:
    """b0 for the centre of mass that is expected, against b0 after the projection."""
    data: RobotData = request.getfixturevalue(which)
    weight = data.robot.mass * 9.81
    slope = [[-3, -3, -0.3], [3, -3, 0.3], [3, 3, 0.3], [-3, 3, -0.3]]
    generator = ContactGenerator(data, Scene([make_surface("s", slope, 0.5)]), GRAVITY, -1e9)
    rng = np.random.default_rng(5)
    start = np.zeros(len(data.robot.root_index))
    start[2], start[6] = height, 1.0
    state = start_state(generator, start, limbs)
    expected, reached = [], []
    for limb in limbs * 3:
        q = state.q.copy()
        q[:2] += rng.uniform(-0.35, 0.35, 2)  # it falls over, now and then
        others = [contact for contact in state.contacts if contact.limb != limb]
        asked: list[float] = []

        def judge(
            contact: Contact,
            com: Array,
            others: list[Contact] = others,
            asked: list[float] = asked,
        ) -> bool:
            asked.append(generator.body.b0([*others, contact], com))
            return False

        still = LookAhead.still(q[data.robot.root_index])
        for trial, contact in generator._placed(q, limb, others, still, None, judge):
            expected.append(asked[-1])
            reached.append(generator.body.robustness(trial, [*others, contact]))
    before, after = np.array(expected), np.array(reached)
    assert len(before) > 200
    for threshold in np.quantile(after, np.linspace(0.05, 0.95, 19)):
        hopeless = before < threshold - COM_MARGIN * weight
        assert (after[hopeless] < threshold).all()
        assert hopeless[after < threshold - 2 * COM_MARGIN * weight].all()  # and it does save some


def test_hopeless_candidates_are_not_projected(
    hyq_data: RobotData, flat_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer is the same as without the short cut, for fewer projections."""
    found, projected = [], []
    for doubt in (COM_MARGIN, np.inf):
        monkeypatch.setattr("rbprm_core.contacts.along_guide.generator.COM_MARGIN", doubt)
        generator = ContactGenerator(hyq_data, flat_scene, GRAVITY, 10.0)
        state = standing(generator, root_at(0, 0, 0.6))
        before = generator.counters.counts["projection"]
        for limb in LEGS:
            for shift in (0.0, 0.1, 0.2, 0.3):
                q = state.q.copy()
                q[0] += shift
                others = [c for c in state.contacts if c.limb != limb]
                ahead = LookAhead.still(q[:7])
                for minimum in (10.0, 100.0, 200.0, 1e3):
                    made = generator.generate(q, limb, others, ahead, min_robustness=minimum)
                    placed_at = isinstance(made, Placed) and made.contact.position.tolist()
                    found.append(placed_at or made)
        projected.append(generator.counters.counts["projection"] - before)
    half = len(found) // 2
    assert found[:half] == found[half:]
    assert Cause.NO_EQUILIBRIUM in found
    assert projected[0] < 0.7 * projected[1]
