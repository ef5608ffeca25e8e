"""Knees, thighs and forearms in contact: limbs that are tied to a sphere, and parts of balls."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.check import CheckReport, check_plan
from rbprm_core.contacts.along_guide import ContactGenerator, start_state
from rbprm_core.contacts.along_guide.generator import Placed
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planner import plan
from rbprm_core.request import END_TOLERANCE
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.robot.description import RobotDescription
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Scene, make_surface

Array = NDArray[np.float64]

GRAVITY = np.array([0.0, 0.0, -9.81])
ALL_FOURS = (0, 1, 2, 3)  # indices of the limbs


def with_samples(text: RobotDescription, draws: int, samples: int) -> RobotDescription:
    volumes = text.volumes.model_copy(update={"samples": draws})
    limbs = tuple(limb.model_copy(update={"samples": samples}) for limb in text.limbs)
    return text.model_copy(update={"volumes": volumes, "limbs": limbs})


@pytest.fixture(scope="module")
def crawl() -> Scenario:
    return load_scenario("crawl")


@pytest.fixture(scope="module")
def kneeling_data(crawl: Scenario) -> RobotData:
    """Data of Talos on knees and hands."""
    return load_robot_data(Robot.load(with_samples(crawl.load_robot().description, 3000, 3000)))


@pytest.fixture(scope="module")
def generator(kneeling_data: RobotData, crawl: Scenario) -> ContactGenerator:
    return ContactGenerator(kneeling_data, crawl.scene(), GRAVITY, 0.0)


@pytest.fixture(scope="module")
def kneeling(generator: ContactGenerator, crawl: Scenario) -> State:
    """The scenario's start."""
    robot = generator.robot
    start = crawl.request_for(robot).start
    joints = robot.reference[robot.root_index[7:]]
    root = np.concatenate([start.position, start.orientation, joints])
    return start_state(generator, root, ALL_FOURS)


@pytest.fixture(scope="module")
def crawl_plan(kneeling_data: RobotData, crawl: Scenario) -> ContactPlan:
    request = crawl.request_for(kneeling_data.robot)
    outcome = plan(request, kneeling_data, crawl.scene(), Budget(60.0))
    return contact_plan(outcome, request, kneeling_data.robot, crawl.environment_entry())


@pytest.fixture(scope="module")
def report(crawl_plan: ContactPlan) -> CheckReport:
    return check_plan(crawl_plan)


def center(robot: Robot, q: Array, limb: int) -> pin.SE3:
    """The contact frame of a limb in the world."""
    data, this = robot.model.createData(), robot.limbs[limb]
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[this.frame] * this.contact


def knees(robot: Robot) -> list[int]:
    return [k for k, limb in enumerate(robot.limbs) if limb.name.endswith("knee")]


def test_the_robot_crawls_a_metre(crawl_plan: ContactPlan, report: CheckReport) -> None:
    assert [str(violation) for violation in report.violations] == []
    first, last = crawl_plan.states[0], crawl_plan.states[-1]
    slack = crawl_plan.request.position_tolerance
    assert last.root.position[0] - first.root.position[0] > 1.0 - slack
    touched = {contact.limb for state in crawl_plan.states for contact in state.contacts}
    assert touched == {"left_knee", "right_knee", "left_arm", "right_arm"}


def test_the_plan_says_how_far_its_root_may_leave_the_goal(
    crawl_plan: ContactPlan, crawl: Scenario
) -> None:
    slack = crawl.options.sequence.root_slack
    assert slack > 0
    assert crawl_plan.request.position_tolerance == pytest.approx(END_TOLERANCE + slack)
    for state in crawl_plan.states:  # the guide is straight, from start to goal at one height
        assert abs(state.root.position[1]) <= slack
        assert abs(state.root.position[2] - crawl_plan.guide[0].position[2]) <= slack


def test_knees_are_tied_and_hands_are_not(generator: ContactGenerator) -> None:
    robot = generator.robot
    tied = [
        limb.name for k, limb in enumerate(robot.limbs) if generator.body.moves_on_surface_only(k)
    ]
    assert sorted(tied) == ["left_knee", "right_knee"]
    for k in knees(robot):  # the hip's three axes meet: the knee stays on a sphere about them
        database = generator._databases[k]
        middle = np.linalg.lstsq(
            np.hstack([2 * database.positions, np.ones((len(database.positions), 1))]),
            (database.positions**2).sum(axis=1),
            rcond=None,
        )[0][:3]
        radii = np.linalg.norm(database.positions - middle, axis=1)
        assert np.ptp(radii) < 1e-6


def test_what_touches_is_on_the_ground_and_on_the_front_of_the_knee(
    generator: ContactGenerator, kneeling: State
) -> None:
    robot = generator.robot
    for k in knees(robot):
        contact, limb = kneeling.contact_of(k), robot.limbs[k]
        assert contact is not None
        frame = center(robot, kneeling.q, k)
        assert frame.translation[2] == pytest.approx(limb.radius, abs=1e-4)
        assert contact.position[:2] == pytest.approx(frame.translation[:2], abs=1e-4)
        assert frame.rotation[:, 2] @ contact.normal >= limb.min_cosine


def test_a_new_contact_of_a_knee_is_somewhere_else(
    generator: ContactGenerator, kneeling: State
) -> None:
    for k in knees(generator.robot):
        old = kneeling.contact_of(k)
        others = [contact for contact in kneeling.contacts if contact is not old]
        ahead = LookAhead.still(kneeling.q[generator.robot.root_index])
        found = generator.generate(kneeling.q, k, others, ahead, replaced=old)
        assert isinstance(found, Placed)
        assert old is not None
        distance = np.linalg.norm(found.contact.position - old.position)
        assert distance > generator.options.move


@pytest.mark.parametrize("step", [-0.06, 0.03, 0.06])
def test_the_root_yields_so_that_a_knee_stays(
    generator: ContactGenerator, kneeling: State, step: float
) -> None:
    robot, most = generator.robot, 0.03
    k = knees(robot)[0]
    contact = kneeling.contact_of(k)
    assert contact is not None
    q = kneeling.q.copy()
    q[0] += step
    assert generator.body.project(q, contact) is None
    moved = generator.body.project_with_root(q, contact, most)
    assert moved is not None
    assert 0 < np.linalg.norm(moved[:3] - q[:3]) <= most
    assert np.array_equal(moved[3:7], q[3:7])
    kept = center(robot, moved, k).translation - robot.limbs[k].radius * contact.normal
    assert kept == pytest.approx(contact.position, abs=1e-4)
    others = np.setdiff1d(np.arange(7, len(q)), robot.limbs[k].q_index)
    assert np.array_equal(moved[others], q[others])


def test_the_root_yields_no_farther_than_it_may(
    generator: ContactGenerator, kneeling: State
) -> None:
    contact = kneeling.contact_of(knees(generator.robot)[0])
    assert contact is not None
    q = kneeling.q.copy()
    q[2] += 0.06
    assert generator.body.project_with_root(q, contact, 0.03) is None
    assert generator.body.project_with_root(q, contact, 0.12) is not None


def test_a_knee_that_turns_its_side_to_the_ground_is_no_contact(
    generator: ContactGenerator, kneeling: State
) -> None:
    limb = generator.robot.limbs[knees(generator.robot)[0]]
    joints = kneeling.q[limb.q_index]
    normal = limb.kinematics.placement_and_jacobian(joints)[1][:, 2].copy()
    assert limb.faces(joints, normal)
    assert not limb.faces(joints, -normal)
    across = np.cross(normal, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    angle = np.arccos(limb.min_cosine)
    for off, expected in ((angle - 0.01, True), (angle + 0.01, False)):
        assert limb.faces(joints, np.cos(off) * normal + np.sin(off) * across) is expected


def test_a_knee_stays_away_from_the_edge_of_what_it_kneels_on(
    kneeling_data: RobotData, kneeling: State
) -> None:
    corners = [(-1.0, -1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]
    generator = ContactGenerator(
        kneeling_data, Scene([make_surface("mat", corners, 0.5)]), GRAVITY, 0.0
    )
    finder, k = generator._footholds, knees(kneeling_data.robot)[0]
    margin = generator.options.edge_margin
    assert finder.holds(k, 0, np.array([-0.5, 0.0, 0.0]))
    assert finder.holds(k, 0, np.array([-1.1 * margin, 0.0, 0.0]))
    assert not finder.holds(k, 0, np.array([-0.9 * margin, 0.0, 0.0]))
    assert not finder.holds(k, 0, np.array([0.1, 0.0, 0.0]))


@pytest.mark.parametrize("part", ["knee", "thigh", "forearm"])
def test_balls_of_body_parts_are_near_the_links_that_they_stand_for(part: str) -> None:
    names = [f"{side}_{part}" for side in ("left", "right")]
    robot = Robot.load(load_description("talos").using(names))
    for limb in robot.limbs:
        geometry = next(
            body
            for body in robot.geometry.geometryObjects
            if robot.model.frames[body.parentFrame].name == limb.effector
        )
        geometry.geometry.buildConvexHull(True, "Qt")
        towards = -limb.contact.rotation[:, 2]
        point = limb.contact.translation + limb.radius * towards
        placed = geometry.placement.actInv(point)
        hull = np.asarray(geometry.geometry.convex.points())
        reach = (hull - placed) @ (geometry.placement.rotation.T @ towards)
        assert -0.01 < reach.max() < 1e-3  # the link ends where the ball does, or a little before


def test_an_axis_without_direction_is_refused() -> None:
    text = load_description("talos").using(["left_knee"])
    (limb,) = text.limbs
    contact = limb.contact.model_copy(update={"axis": (0.0, 0.0, 0.0)})
    changed = text.model_copy(update={"limbs": (limb.model_copy(update={"contact": contact}),)})
    with pytest.raises(InvalidInput, match="must not be zero") as caught:
        Robot.load(changed)
    assert caught.value.field == "limbs.left_knee.contact.axis"
