"""Postures that the generator finds, and failures as data where there are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.body import Contact, State
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.surface_contact import SurfaceContact
from rbprm_core.posture.constraints.tasks import PointInBox, Upright
from rbprm_core.posture.criteria import ReferencePosture, Robustness
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.registry import POSTURE_GENERATORS
from rbprm_core.robot import Robot

from .conftest import Sequence, Walks

UP = np.array([0.0, 0.0, 1.0])


def state_of(found: State | Failure) -> State:
    assert isinstance(found, State), found
    return found


def contact_error(robot: Robot, q: Array, contact: Contact) -> float:
    """Distance of the contact frame from a contact, metres; of a patch also its rotation, rad."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    limb = robot.limbs[contact.limb]
    place = data.oMf[limb.frame] * limb.contact
    target = contact.position + limb.radius * contact.normal
    error = float(np.linalg.norm(place.translation - target))
    if not limb.planar:
        return error
    return max(error, float(np.linalg.norm(pin.log3(place.rotation.T @ contact.rotation))))


def shifted(walk: Sequence, q: Array, size: float, seed: int) -> Array:
    """The configuration with its root moved."""
    moved = q.copy()
    moved[:3] += np.random.default_rng(seed).uniform(-size, size, 3)
    return moved


@pytest.mark.parametrize("name", ["rubble", "stairs10"])
def test_contacts_are_reached_from_afar(walks: Walks, name: str) -> None:
    walk, solved = walks(name), 0
    for k, state in enumerate(walk.states[::4]):
        problem = PostureProblem(state.contacts, state.contacts, 5.0)
        found = walk.generator.solve(problem, shifted(walk, state.q, 0.1, k))
        if isinstance(found, Failure):
            continue
        solved += 1
        assert max(contact_error(walk.robot, found.q, c) for c in state.contacts) < 1e-5
        assert (found.q >= walk.robot.low - 1e-9).all()
        assert (found.q <= walk.robot.high + 1e-9).all()
        assert found.robustness >= 5.0
        assert found.contacts == state.contacts
        data = walk.robot.model.createData()
        com = pin.centerOfMass(walk.robot.model, data, found.q)
        assert found.com == pytest.approx(com)
        assert found.robustness == pytest.approx(walk.model.stability.b0(state.contacts, com))
    assert solved >= 0.9 * len(walk.states[::4])


def test_a_state_that_satisfies_the_problem_stays_as_it_is(rubble_walk: Sequence) -> None:
    problem = PostureProblem(rubble_walk.states[0].contacts, rubble_walk.states[0].contacts, 5.0)
    first = state_of(rubble_walk.generator.solve(problem, rubble_walk.states[0].q))
    again = state_of(rubble_walk.generator.solve(problem, first.q))
    assert again.q == pytest.approx(first.q, abs=1e-12)


def test_the_same_problem_has_the_same_posture(high_step: Sequence) -> None:
    """To the last digit, whatever the generator has solved before."""
    problems = [high_step.problem(k) for k in range(len(list(high_step.witnesses())))]
    first = [high_step.solver().solve(*problem) for problem in problems]
    generator = high_step.solver()
    second = [generator.solve(*problem) for problem in reversed(problems)][::-1]
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(state_of(one).q, state_of(other).q)


def test_torques_stay_below_their_limit(high_step: Sequence) -> None:
    state = high_step.states[0]
    model = high_step.model.torques
    ratio = model.balance(state.q, state.contacts).ratio
    problem = PostureProblem(state.contacts, state.contacts, 5.0, max_torque_ratio=0.97 * ratio)
    found = state_of(high_step.generator.solve(problem, state.q))
    assert model.balance(found.q, found.contacts).ratio <= 0.97 * ratio
    assert max(contact_error(high_step.robot, found.q, c) for c in state.contacts) < 1e-5


def test_a_link_is_kept_upright(rubble_walk: Sequence) -> None:
    state, robot = rubble_walk.states[12], rubble_walk.robot
    task = Upright(robot, "trunk", UP, UP, 0.01)
    problem = PostureProblem(state.contacts, state.contacts, 5.0, tasks=(task,))
    start = state.q.copy()
    start[3:7] = pin.Quaternion(
        pin.Quaternion(state.q[3:7]).matrix() @ pin.exp3(np.array([0.1, 0.1, 0.0]))
    ).coeffs()
    found = state_of(rubble_walk.generator.solve(problem, start))
    axis = pin.Quaternion(found.q[3:7]).matrix()[:, 2]
    assert np.arccos(axis @ UP) < 0.01 + 1e-4


def test_a_point_stays_in_its_box(rubble_walk: Sequence) -> None:
    state, robot = rubble_walk.states[0], rubble_walk.robot
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, state.q)
    there = data.oMf[robot.model.getFrameId("trunk")].translation + np.array([0.03, 0.0, -0.02])
    task = PointInBox(robot, "trunk", np.zeros(3), there - 1e-3, there + 1e-3)
    problem = PostureProblem(state.contacts, state.contacts, 5.0, tasks=(task,))
    found = state_of(rubble_walk.generator.solve(problem, state.q))
    pin.framesForwardKinematics(robot.model, data, found.q)
    offset = data.oMf[robot.model.getFrameId("trunk")].translation - there
    assert np.abs(offset).max() <= 1e-3 + 2e-5


@pytest.mark.parametrize("name", ["rubble", "stairs10"])
def test_a_free_contact_lies_inside_the_edges_of_its_surface(walks: Walks, name: str) -> None:
    """A limb finds its place on the surface that the plan uses, from the state before."""
    walk, tried, solved = walks(name), 0, 0
    for contacts, supporting, start in walk.witnesses():
        new = contacts[-1]
        if new.limb in {contact.limb for contact in supporting}:
            continue
        surface = walk.scene.surfaces[walk.scene.index[new.surface]]
        pieces = range(len(surface.polygon.pieces))
        # The piece that the plan's contact is on.
        piece = min(pieces, key=lambda k: -_depth(surface.polygon.pieces[k], surface.normal, new))
        free = SurfaceContact(new.limb, surface, piece, edge_margin=0.01)
        problem = PostureProblem(supporting, supporting, 0.0, free_contacts=(free,))
        tried += 1
        found = walk.generator.solve(problem, start)
        if isinstance(found, Failure):
            continue
        solved += 1
        contact = found.contact_of(new.limb)
        assert contact is not None
        assert contact.surface == surface.id
        assert contact_error(walk.robot, found.q, contact) < 1e-4
        plane = surface.polygon.plane
        for point in contact.points:
            assert abs(surface.normal @ (point - plane.origin)) < 1e-9
        assert _depth(surface.polygon.pieces[piece], surface.normal, contact) > 0.01 - 2e-5
    assert tried > 4
    assert solved >= 0.9 * tried


def _depth(ring: Array, normal: Array, contact: Contact) -> float:
    """Smallest distance of a contact's points from the edges of a convex piece, inside positive."""
    edges = np.roll(ring, -1, axis=0) - ring
    inward = np.cross(normal, edges)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    return float(min((inward * (point - ring)).sum(axis=1).min() for point in contact.points))


def test_a_criterion_makes_postures_better(rubble_walk: Sequence) -> None:
    state = rubble_walk.states[3]
    plain = PostureProblem(state.contacts, state.contacts, 5.0)
    criterion = Robustness(rubble_walk.model.stability, state.contacts)
    generator = rubble_walk.solver(criterion_steps=20)
    robust = state_of(generator.solve(replace(plain, criterion=criterion), state.q))
    assert robust.robustness > state.robustness + 1.0
    reference = rubble_walk.states[4].q
    near = state_of(generator.solve(replace(plain, criterion=ReferencePosture(reference)), state.q))
    coordinates = rubble_walk.model.coordinates
    before, after = (coordinates.difference(reference, q) for q in (state.q, near.q))
    assert np.linalg.norm(after) < np.linalg.norm(before)


@pytest.mark.parametrize("solver", ["osqp", "proxqp"])
def test_other_solvers_find_the_posture_too(rubble_walk: Sequence, solver: str) -> None:
    for k in (0, 5, 11):
        problem, start = rubble_walk.problem(k)
        found = state_of(rubble_walk.solver(qp_solver=solver).solve(problem, start))
        expected = state_of(rubble_walk.generator.solve(problem, start))
        assert found.q == pytest.approx(expected.q, abs=1e-3)


def test_the_generator_is_known_by_its_name(rubble_walk: Sequence) -> None:
    assert POSTURE_GENERATORS.names() == ("sqp",)


def moved_contact(contact: Contact, offset: Array) -> Contact:
    return replace(contact, position=contact.position + offset, points=contact.points + offset)


def test_a_contact_out_of_reach_is_named_with_its_distance(rubble_walk: Sequence) -> None:
    state = rubble_walk.states[0]
    far = moved_contact(state.contacts[0], np.array([0.0, 0.0, 3.0]))
    problem = PostureProblem((far, *state.contacts[1:]), state.contacts[1:], 0.0)
    found = rubble_walk.generator.solve(problem, state.q)
    assert isinstance(found, Failure)
    assert found.cause is Cause.CONTACT_NOT_REACHED
    assert found.limb in {limb.name for limb in rubble_walk.robot.limbs}
    assert found.figure("distance") > 0.1


def test_too_much_robustness_is_named_with_what_is_reached(rubble_walk: Sequence) -> None:
    state = rubble_walk.states[0]
    problem = PostureProblem(state.contacts, state.contacts, 1e4)
    found = rubble_walk.generator.solve(problem, state.q)
    assert isinstance(found, Failure)
    assert found.cause is Cause.LOW_ROBUSTNESS
    assert 0.0 < found.figure("robustness") < 1e4
    assert (found.figure("threshold"), found.figure("contacts")) == (1e4, len(state.contacts))


def test_a_task_that_contradicts_the_contacts_has_a_failure(rubble_walk: Sequence) -> None:
    """Either of the two may be named: one of them cannot be met."""
    state, robot = rubble_walk.states[0], rubble_walk.robot
    task = Upright(robot, "trunk", UP, -UP, 0.1)
    problem = PostureProblem(state.contacts, state.contacts, -np.inf, tasks=(task,))
    found = rubble_walk.generator.solve(problem, state.q)
    assert isinstance(found, Failure)
    assert found.cause in (Cause.TASK_NOT_MET, Cause.CONTACT_NOT_REACHED)
    assert found.body == "trunk upright" or found.limb


def test_a_torque_limit_that_no_posture_keeps_is_named(high_step: Sequence) -> None:
    state = high_step.states[0]
    problem = PostureProblem(state.contacts, state.contacts, 0.0, max_torque_ratio=1e-3)
    found = high_step.generator.solve(problem, state.q)
    assert isinstance(found, Failure)
    assert found.cause is Cause.TORQUE_LIMIT
    assert found.figure("ratio") > found.figure("limit") == 1e-3


def test_a_collision_that_stays_is_named(rubble_walk: Sequence) -> None:
    """The trunk is forced into the ground."""
    state, robot = rubble_walk.states[0], rubble_walk.robot
    low = np.array([-np.inf, -np.inf, -np.inf])
    task = PointInBox(robot, "trunk", np.zeros(3), low, np.array([np.inf, np.inf, 0.02]))
    problem = PostureProblem((), (), -np.inf, tasks=(task,))
    found = rubble_walk.generator.solve(problem, state.q)
    assert isinstance(found, Failure)
    assert found.cause in (Cause.BODY_COLLISION, Cause.SELF_COLLISION, Cause.TASK_NOT_MET)
    assert found.body
