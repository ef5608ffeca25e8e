"""Whole-body queries: inverse kinematics of contacts, centre of mass and robustness."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.whole_body import WholeBody
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.statics import Equilibrium, cone_generators, robustness

GRAVITY = np.array([0.0, 0.0, -9.81])
LEGS = (0, 1, 2, 3)


@pytest.fixture(scope="module")
def body(hyq_data: RobotData, flat_scene: Scene) -> WholeBody:
    """HyQ on flat ground."""
    return WholeBody(hyq_data, flat_scene, GRAVITY, 10.0)


def standing(robot: Robot) -> tuple[Array, list[Contact]]:
    """The reference posture with the feet on the ground, and the contacts of the feet."""
    q = robot.reference.copy()
    feet = np.array([foot(robot, q, limb) for limb in LEGS])
    q[2] += robot.limbs[0].radius - feet[:, 2].min()
    contacts = []
    for limb in LEGS:
        x, y, _ = foot(robot, q, limb)
        position = np.array([x, y, 0.0])
        cone = cone_generators(np.eye(3), 0.5)[None]
        contacts.append(Contact(limb, position, np.eye(3), position[None], cone, 0.5, "ground"))
    return q, contacts


def foot(robot: Robot, q: Array, limb: int) -> Array:
    """Centre (3,) of the ball of a foot in the planning frame."""
    data, this = robot.model.createData(), robot.limbs[limb]
    pin.framesForwardKinematics(robot.model, data, q)
    return np.asarray(data.oMf[this.frame].act(this.contact.translation)).copy()


@pytest.mark.parametrize("limb", LEGS)
def test_project_keeps_the_contact_and_moves_one_limb(body: WholeBody, limb: int) -> None:
    robot = body.robot
    q, contacts = standing(robot)
    moved = q.copy()
    moved[:3] += [0.03, -0.02, -0.02]
    found = body.project(moved, contacts[limb])
    assert found is not None
    centre = contacts[limb].position + robot.limbs[limb].radius * contacts[limb].normal
    assert foot(robot, found, limb) == pytest.approx(centre, abs=1e-4)
    others = np.setdiff1d(np.arange(len(q)), robot.limbs[limb].q_index)
    assert np.array_equal(found[others], moved[others])
    far = q.copy()
    far[0] += 2.0
    assert body.project(far, contacts[limb]) is None


def test_project_with_root_shifts_the_root_no_farther_than_it_may(body: WholeBody) -> None:
    robot = body.robot
    q, contacts = standing(robot)
    lifted = q.copy()
    lifted[2] += 0.2  # the legs are too short
    assert body.project(lifted, contacts[0]) is None
    assert body.project_with_root(lifted, contacts[0], 0.02) is None
    found = body.project_with_root(lifted, contacts[0], 0.1)
    assert found is not None
    assert 0 < np.linalg.norm(found[:3] - lifted[:3]) <= 0.1
    assert np.array_equal(found[3:7], lifted[3:7])
    centre = contacts[0].position + robot.limbs[0].radius * contacts[0].normal
    assert foot(robot, found, 0) == pytest.approx(centre, abs=1e-3)


def test_centre_of_mass_and_base_agree_with_pinocchio(body: WholeBody) -> None:
    robot = body.robot
    rng = np.random.default_rng(0)
    data = robot.model.createData()
    pin.seed(0)
    for _ in range(20):
        q = pin.randomConfiguration(robot.model, robot.low.clip(-3), robot.high.clip(max=3))
        q[:3] = rng.uniform(-1, 1, 3)
        com = pin.centerOfMass(robot.model, data, q)
        assert body.com(q) == pytest.approx(com)
        for limb in LEGS:
            base = data.oMi[robot.limbs[limb].base]
            assert body.base(q, limb).isApprox(base)


def test_robustness_agrees_with_the_statics(body: WholeBody) -> None:
    robot = body.robot
    q, contacts = standing(robot)
    com = body.com(q)
    for chosen in (contacts, contacts[:3], contacts[:1]):
        points = np.concatenate([c.points for c in chosen])
        rays = np.concatenate([c.generators for c in chosen])
        expected = robustness(Equilibrium.of(points, rays, com, robot.mass, GRAVITY))
        assert body.robustness(q, chosen) == body.b0(chosen, com) == pytest.approx(expected)
    assert body.robustness(q, contacts) > 0 > body.robustness(q, contacts[:1])
    assert body.robustness(q, []) == -np.inf
    assert body.min_robustness == 10.0


def test_a_state_has_the_centre_of_mass_of_its_configuration(body: WholeBody) -> None:
    q, contacts = standing(body.robot)
    state = body.state(q, contacts, 3.0)
    assert state.com == pytest.approx(body.com(q))
    assert state.contacts == tuple(contacts)
    assert state.robustness == 3.0


def test_a_limb_in_contact_is_free_and_one_in_the_ground_is_not(body: WholeBody) -> None:
    q, contacts = standing(body.robot)
    counted = body.counters.counts["collision"]
    assert body.limb_is_free(q, 0, contacts[0].normal)
    q[2] -= 0.1
    assert not body.limb_is_free(q, 0, None)
    assert body.counters.counts["collision"] == counted + 2


def test_point_feet_move_freely(body: WholeBody) -> None:
    assert not any(body.moves_on_surface_only(limb) for limb in LEGS)
