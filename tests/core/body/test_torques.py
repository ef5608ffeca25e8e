"""The torque ratio against a linear program with explicit forces and numerical Jacobians."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog

from rbprm_core.arrays import Array
from rbprm_core.body import Contact, State
from rbprm_core.body.torques import TorqueModel
from rbprm_core.outcome import Outcome
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

GRAVITY = np.array([0.0, 0.0, -9.81])
Walk = tuple[Robot, list[State]]


@pytest.fixture(scope="module")
def dog(hyq: Robot, outcomes: dict[int, tuple[PlanRequest, Outcome]]) -> Walk:
    """HyQ, and some of its states on the rubble."""
    return hyq, list(outcomes[0][1].states[::8])


@pytest.fixture(scope="module")
def human(climb: tuple[RobotData, Scene, PlanRequest, Outcome]) -> Walk:
    """Talos, and some of its states on a step."""
    return climb[0].robot, list(climb[3].states[::3])


@pytest.fixture(scope="module", params=["dog", "human"])
def walk(request: pytest.FixtureRequest) -> Walk:
    """Each robot with its states."""
    found: Walk = request.getfixturevalue(request.param)
    return found


def point_jacobian(robot: Robot, q: Array, contact: Contact, point: Array) -> Array:
    """Jacobian (3, nv) of a point that moves with a contact's link, by central differences."""
    model, data = robot.model, robot.model.createData()
    frame = robot.limbs[contact.limb].frame
    pin.framesForwardKinematics(model, data, q)
    local, step = data.oMf[frame].actInv(point), 1e-6
    columns = []
    for unit in np.eye(model.nv):
        ends = []
        for sign in (1.0, -1.0):
            pin.framesForwardKinematics(model, data, pin.integrate(model, q, sign * step * unit))
            ends.append(data.oMf[frame].act(local))
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.array(columns).T


def facets(contact: Contact) -> Array:
    """Inward normals (4, 3) of the facets of the friction pyramid, n.f >= 0 inside."""
    t1, t2, n = contact.rotation.T
    mu = contact.friction
    return np.array([mu * n + a * t1 + b * t2 for a in (1, -1) for b in (1, -1)])


def explicit_ratio(robot: Robot, state: State) -> float:
    """The torque ratio, from a program in the components of the forces at the points."""
    model = robot.model
    still = np.zeros(model.nv)
    gravity = pin.rnea(model, model.createData(), state.q, still, still)
    points = [(contact, point) for contact in state.contacts for point in contact.points]
    jacobian = np.vstack([point_jacobian(robot, state.q, *pair) for pair in points])
    effort = np.asarray(model.effortLimit)[6:]
    limited = (effort > 0) & (effort < 1e6)
    loads = jacobian[:, 6:].T[limited] / effort[limited, None]
    offset, ones = gravity[6:][limited] / effort[limited], np.ones((int(limited.sum()), 1))
    cones = np.zeros((4 * len(points), 3 * len(points) + 1))
    for k, (contact, _) in enumerate(points):
        cones[4 * k : 4 * k + 4, 3 * k : 3 * k + 3] = -facets(contact)
    found = linprog(
        np.append(np.zeros(3 * len(points)), 1.0),
        np.vstack([np.hstack([-loads, -ones]), np.hstack([loads, -ones]), cones]),
        np.concatenate([-offset, offset, np.zeros(len(cones))]),
        np.hstack([jacobian[:, :6].T, np.zeros((6, 1))]),
        gravity[:6],
        bounds=(None, None),
        method="highs",
    )
    assert found.status == 0
    return float(found.fun)


def test_the_ratio_is_that_of_explicit_forces(walk: Walk) -> None:
    robot, states = walk
    model = TorqueModel(robot, GRAVITY)
    for state in states[:4]:
        found = model.balance(state.q, state.contacts)
        assert found.ratio == pytest.approx(explicit_ratio(robot, state), rel=1e-5)


def test_the_forces_balance_the_robot_inside_their_cones(walk: Walk) -> None:
    robot, states = walk
    model = TorqueModel(robot, GRAVITY)
    for state in states:
        balance = model.balance(state.q, state.contacts)
        points = np.concatenate([contact.points for contact in state.contacts])
        weight = robot.mass * GRAVITY
        assert balance.forces.sum(axis=0) == pytest.approx(-weight, abs=1e-5)
        moment = np.cross(points - state.com, balance.forces).sum(axis=0)
        assert moment == pytest.approx(np.zeros(3), abs=1e-4)
        first = 0
        for contact in state.contacts:
            for force in balance.forces[first : first + len(contact.points)]:
                assert (facets(contact) @ force > -1e-6).all()
            first += len(contact.points)


def test_the_torques_are_those_of_inverse_dynamics(walk: Walk) -> None:
    robot, states = walk
    model = TorqueModel(robot, GRAVITY)
    state, still = states[1], np.zeros(robot.model.nv)
    balance = model.balance(state.q, state.contacts)
    needed = pin.rnea(robot.model, robot.model.createData(), state.q, still, still)
    points = [(contact, point) for contact in state.contacts for point in contact.points]
    for (contact, point), force in zip(points, balance.forces, strict=True):
        needed = needed - point_jacobian(robot, state.q, contact, point).T @ force
    assert needed[:6] == pytest.approx(np.zeros(6), abs=1e-3)
    assert needed[6:] == pytest.approx(balance.torques, abs=1e-3)
    shares = np.abs(balance.torques) / model.limits
    assert shares.max() == pytest.approx(balance.ratio)
    assert robot.joint_names[int(shares.argmax())] == balance.joint


def test_without_support_no_forces_balance_the_robot(dog: Walk) -> None:
    robot, states = dog
    model = TorqueModel(robot, GRAVITY)
    for contacts in ((), states[0].contacts[:1]):
        balance, gradient = model.balance_gradient(states[0].q, contacts)
        assert balance.ratio == np.inf
        assert np.isnan(balance.forces).all()
        assert not gradient.any()


def test_gravity_that_is_halved_halves_the_ratio(dog: Walk) -> None:
    robot, states = dog
    whole = TorqueModel(robot, GRAVITY).balance(states[0].q, states[0].contacts)
    half = TorqueModel(robot, 0.5 * GRAVITY).balance(states[0].q, states[0].contacts)
    assert half.ratio == pytest.approx(0.5 * whole.ratio)


def test_the_order_of_contacts_does_not_change_the_ratio(human: Walk) -> None:
    robot, states = human
    model = TorqueModel(robot, GRAVITY)
    state = states[1]
    turned = replace(state, contacts=state.contacts[::-1])
    ratios = [model.balance(s.q, s.contacts).ratio for s in (state, turned)]
    assert ratios[0] == pytest.approx(ratios[1])
