"""Rows of the constraints: their Jacobians against finite differences, and what they bound."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.body import State
from rbprm_core.errors import InvalidInput
from rbprm_core.failures import Cause
from rbprm_core.posture.constraints.clearance import Clearance
from rbprm_core.posture.constraints.contact_pose import ContactPose
from rbprm_core.posture.constraints.equilibrium import MARGIN, EquilibriumOnContacts
from rbprm_core.posture.constraints.rows import Constraint, Rows
from rbprm_core.posture.constraints.surface_contact import ContactOnSurface, SurfaceContact
from rbprm_core.posture.constraints.tasks import PointInBox, Upright
from rbprm_core.posture.constraints.torque import TorqueRatio

from .conftest import Sequence, Walks

STEP = 1e-6
NAMES = ("rubble", "stairs10")


def moved(walk: Sequence, q: Array, size: float, seed: int) -> Array:
    """A configuration near another, all coordinates changed at random."""
    step = np.random.default_rng(seed).uniform(-size, size, walk.robot.model.nv)
    return np.asarray(pin.integrate(walk.robot.model, q, step))


def slope_error(
    walk: Sequence, constraint: Constraint, q: Array, seed: int, rows: slice = slice(None)
) -> float:
    """Largest difference between a Jacobian and differences of the bounds, in one direction.

    A row bounds the change of a value by what is missing: a step changes the bounds by minus the
    Jacobian times the step.
    """
    model = walk.robot.model
    direction = np.random.default_rng(seed).normal(size=model.nv)
    direction /= np.linalg.norm(direction)
    bounds = []
    for sign in (1.0, -1.0):
        there = constraint.rows(
            walk.model.kinematics(pin.integrate(model, q, sign * STEP * direction))
        )
        bounds.append(_finite(there)[rows])
    here = constraint.rows(walk.model.kinematics(q))
    slopes = (bounds[0] - bounds[1]) / (2 * STEP)
    return float(np.abs(slopes + (here.matrix @ direction)[rows]).max())


def _finite(rows: Rows) -> Array:
    return np.where(np.isfinite(rows.lower), rows.lower, rows.upper)


def some_states(walk: Sequence) -> list[State]:
    return list(walk.states[:: max(1, len(walk.states) // 4)])


@pytest.mark.parametrize("name", NAMES)
def test_a_contact_has_the_jacobian_of_its_pose(walks: Walks, name: str) -> None:
    walk = walks(name)
    for k, state in enumerate(some_states(walk)):
        for contact in state.contacts:
            constraint = ContactPose(walk.robot, contact)
            # The rotation error of a patch is linear only near the contact.
            size = 1e-4 if walk.robot.limbs[contact.limb].planar else 0.2
            assert slope_error(walk, constraint, moved(walk, state.q, size, k), k) < 1e-3


def test_a_part_of_a_ball_keeps_its_side_to_the_surface(rubble_walk: Sequence) -> None:
    state = rubble_walk.states[0]
    contact, robot = state.contacts[0], rubble_walk.robot
    limb = robot.limbs[contact.limb]
    spot = replace(limb.spot, min_cosine=0.95)
    facing = SimpleNamespace(limbs={contact.limb: SimpleNamespace(spots=(spot,), name=limb.name)})
    constraint = ContactPose(facing, contact)  # type: ignore[arg-type]
    for seed in range(5):
        q = moved(rubble_walk, state.q, 0.3, seed)
        assert slope_error(rubble_walk, constraint, q, seed) < 1e-5
        kinematics = rubble_walk.model.kinematics(q)
        rows, axis = constraint.rows(kinematics), kinematics.spot(spot)[0].rotation[:, 2]
        assert rows.lower[3] == pytest.approx(0.95 - axis @ contact.normal)
        assert rows.upper[3] == np.inf


@pytest.mark.parametrize("name", NAMES)
def test_a_contact_on_a_surface_has_the_jacobian_of_its_place(walks: Walks, name: str) -> None:
    walk = walks(name)
    for k, state in enumerate(some_states(walk)):
        contact = state.contacts[-1]
        surface = walk.scene.surfaces[walk.scene.index[contact.surface]]
        constraint = ContactOnSurface(walk.robot, SurfaceContact(contact.limb, surface))
        q = moved(walk, state.q, 1e-4, k)
        assert slope_error(walk, constraint, q, k) < 1e-3


@pytest.mark.parametrize("name", NAMES)
def test_equilibrium_has_the_gradient_of_the_robustness(walks: Walks, name: str) -> None:
    walk = walks(name)
    for k, state in enumerate(some_states(walk)):
        constraint = EquilibriumOnContacts(walk.model.stability, state.contacts, 5.0)
        q = moved(walk, state.q, 0.02, k)
        assert slope_error(walk, constraint, q, k, slice(1)) < 1e-3 * 9.81 * walk.robot.mass
        b0 = walk.model.stability.b0(state.contacts, walk.model.kinematics(q).com)
        fresh = EquilibriumOnContacts(walk.model.stability, state.contacts, 5.0)
        rows = fresh.rows(walk.model.kinematics(q))
        assert fresh.robustness == pytest.approx(b0)
        assert rows.lower[0] == pytest.approx(5.0 + MARGIN - b0)
        assert fresh.violation(rows) == pytest.approx(max(5.0 - b0, 0.0))


@pytest.mark.parametrize("name", NAMES)
def test_torques_have_the_gradient_of_their_ratio(walks: Walks, name: str) -> None:
    walk = walks(name)
    for k, state in enumerate(some_states(walk)):
        balance, gradient = walk.model.torques.balance_gradient(state.q, state.contacts)
        # The contacts are where they are while the configuration moves: only joints that no
        # contact depends on move the robot without moving the points of the forces.
        free = _unused_coordinates(walk, state)
        if not free.any():
            continue
        direction = np.random.default_rng(k).normal(size=len(gradient)) * free
        moved_by = 1e-5
        ratios = [
            walk.model.torques.balance(
                pin.integrate(walk.robot.model, state.q, sign * moved_by * direction),
                state.contacts,
            ).ratio
            for sign in (1.0, -1.0)
        ]
        slope = (ratios[0] - ratios[1]) / (2 * moved_by)
        assert slope == pytest.approx(gradient @ direction, abs=2e-3 * max(1.0, balance.ratio))


def _unused_coordinates(walk: Sequence, state: State) -> Array:
    """1 for the coordinates of joints that carry no contact."""
    kinematics = walk.model.kinematics(state.q)
    used = np.zeros(walk.robot.model.nv)
    for contact in state.contacts:
        used += np.abs(kinematics.spot(walk.robot.limbs[contact.limb].spot)[1]).sum(axis=0)
    return (used < 1e-12).astype(float)


def test_torques_get_a_row_that_aims_below_the_bound(high_step: Sequence) -> None:
    state = high_step.states[0]
    ratio = high_step.model.torques.balance(state.q, state.contacts).ratio
    limit = TorqueRatio(high_step.model.torques, state.contacts, 0.5 * ratio)
    rows = limit.rows(high_step.model.kinematics(state.q))
    assert limit.violation(rows) == pytest.approx(0.5 * ratio)
    assert rows.upper[0] < -0.5 * ratio
    assert not limit.holds(state.q)
    failure = limit.failure(limit.violation(rows))
    assert failure.cause is Cause.TORQUE_LIMIT
    assert failure.body in high_step.robot.model.names
    assert failure.figure("ratio") == pytest.approx(ratio)
    assert TorqueRatio(high_step.model.torques, state.contacts, 1.01 * ratio).holds(state.q)


@pytest.mark.parametrize("name", NAMES)
def test_tasks_have_the_jacobian_of_their_value(walks: Walks, name: str) -> None:
    walk = walks(name)
    frame = walk.robot.limbs[0].effector
    upright = Upright(walk.robot, frame, np.array([0, 0, 2.0]), np.array([0, 0, 1.0]), 0.1)
    low, high = np.array([-0.1, 0.0, -np.inf]), np.array([0.1, 0.0, 0.4])
    inside = PointInBox(walk.robot, frame, np.array([0.1, 0.2, -0.1]), low, high)
    for k, state in enumerate(some_states(walk)):
        q = moved(walk, state.q, 0.3, k)
        assert slope_error(walk, upright, q, k) < 1e-5
        assert slope_error(walk, inside, q, k) < 1e-5
        rows = inside.rows(walk.model.kinematics(q))
        assert rows.lower[1] == rows.upper[1]
        assert rows.lower[2] == -np.inf
    assert inside.failure(0.5).cause is Cause.TASK_NOT_MET
    assert upright.failure(0.5).figure("violation") == 0.5


def test_a_task_names_a_frame_of_the_robot(rubble_walk: Sequence) -> None:
    with pytest.raises(InvalidInput, match="no frame"):
        Upright(rubble_walk.robot, "tail", np.eye(3)[2], np.eye(3)[2], 0.1)


@pytest.mark.parametrize("name", NAMES)
def test_distances_have_the_jacobian_of_the_gap(walks: Walks, name: str) -> None:
    """Of pairs with one feature only: others change their features as the robot moves."""
    walk = walks(name)
    model, compared = walk.robot.model, 0
    for k, state in enumerate(some_states(walk)):
        q = moved(walk, state.q, 0.05, k)
        direction = np.random.default_rng(k).normal(size=model.nv)
        direction /= np.linalg.norm(direction)
        gaps = [
            _single_gaps(walk, pin.integrate(model, q, sign * 1e-5 * direction))
            for sign in (1.0, -1.0)
        ]
        constraint = Clearance(walk.robot, walk.model.pairs, (), 1e-3)
        kinematics = walk.model.kinematics(q)
        rows = constraint.rows(kinematics)
        near = walk.model.pairs.near(kinematics.data, {})
        for i, pair in enumerate(zip(near.first.tolist(), near.second.tolist(), strict=True)):
            if pair in gaps[0] and pair in gaps[1] and near.gaps[i] > 1e-3:
                slope = (gaps[0][pair] - gaps[1][pair]) / 2e-5
                assert slope == pytest.approx(rows.matrix[i] @ direction, abs=0.02)
                assert rows.lower[i] == pytest.approx(1e-3 - near.gaps[i])
                compared += 1
    assert compared > 1


def _single_gaps(walk: Sequence, q: Array) -> dict[tuple[int, int], float]:
    near = walk.model.pairs.near(walk.model.kinematics(q).data, {})
    pairs = list(zip(near.first.tolist(), near.second.tolist(), strict=True))
    return {
        pair: float(gap)
        for pair, gap in zip(pairs, near.gaps, strict=True)
        if pairs.count(pair) == 1
    }


def test_rows_measure_their_violation_and_distance() -> None:
    rows = Rows(np.array([[2.0, 0.0], [0.0, 0.5]]), np.array([1.0, -np.inf]), np.array([1.0, -0.5]))
    assert rows.violation == 1.0
    assert rows.distance == 1.0
    fulfilled = Rows(np.eye(2), np.full(2, -1.0), np.full(2, 1.0))
    assert (fulfilled.violation, fulfilled.distance) == (0.0, 0.0)
    none = Rows(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    assert (none.violation, none.distance) == (0.0, np.inf)
