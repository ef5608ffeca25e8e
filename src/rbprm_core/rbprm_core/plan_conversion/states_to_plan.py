"""From the planner's outcome to the contact plan that leaves the program."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.errors import RbprmError
from rbprm_core.outcome import Outcome
from rbprm_core.placement import Placement
from rbprm_core.plan_record import (
    ContactEntry,
    ContactPlan,
    EnvironmentEntry,
    GuideNode,
    Pose,
    RobotEntry,
    StateEntry,
    Statistics,
    Vector3,
)
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.validation import MAX_FORCE

Array = NDArray[np.float64]


def contact_plan(
    outcome: Outcome, request: PlanRequest, robot: Robot, environment: EnvironmentEntry
) -> ContactPlan:
    """The plan in the words of the plan file."""
    plan = bare_plan([state_entry(robot, state) for state in outcome.states], request, robot)
    return plan.model_copy(
        update={
            "environment": environment,
            "guide": tuple(_guide_node(node) for node in outcome.guide.nodes),
            "statistics": outcome.statistics,
        }
    )


def partial_plan(
    error: RbprmError, request: PlanRequest, robot: Robot, environment: EnvironmentEntry
) -> ContactPlan | None:
    """The states that planning found before it failed, as a plan that stops short of the goal.

    None where it found none; there is no guide in it.
    """
    if not error.states:
        return None
    plan = bare_plan([state_entry(robot, state) for state in error.states], request, robot)
    statistics = Statistics() if error.statistics is None else error.statistics
    return plan.model_copy(update={"environment": environment, "statistics": statistics})


def bare_plan(states: Iterable[StateEntry], request: PlanRequest, robot: Robot) -> ContactPlan:
    """A plan of some states, without environment, guide and statistics."""
    return ContactPlan(
        robot=robot_entry(robot),
        environment=EnvironmentEntry(),
        request=request.entry(),
        guide=(),
        states=tuple(states),
        statistics=Statistics(),
    )


def robot_entry(robot: Robot) -> RobotEntry:
    """The robot with all choices of limbs, heuristics, surfaces and trunk."""
    description = robot.description
    return RobotEntry(
        name=robot.name,
        urdf=description.urdf,
        srdf=description.srdf,
        joint_names=robot.joint_names,
        root_frame=_root_frame(robot.model),
        root_joints=tuple(robot.model.names[joint] for joint in robot.root_joints),
        description=description.model_dump(mode="json"),
    )


def _root_frame(model: pin.Model) -> str:
    """Name of the URDF's root link, whose frame is that of the floating base."""
    return next(
        str(frame.name)
        for frame in model.frames
        if frame.type == pin.FrameType.BODY and frame.parentJoint == ROOT_JOINT
    )


def state_entry(robot: Robot, state: State) -> StateEntry:
    """One state, with the contact frames measured in the effectors' frames."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, state.q)
    return StateEntry(
        root=_root_pose(state.q),
        joints=tuple(state.q[7:].tolist()),
        com=_vector(state.com),
        robustness=min(state.robustness, MAX_FORCE),
        contacts=tuple(_contact(robot, data, contact) for contact in state.contacts),
    )


def _contact(robot: Robot, data: pin.Data, contact: Contact) -> ContactEntry:
    limb = robot.limbs[contact.limb]
    effector = data.oMf[limb.frame]
    if limb.planar:
        offset = Placement.of(limb.contact)
    else:
        # A ball rolls about its centre, so where the contact is on it follows from the normal.
        center = effector.act(limb.contact.translation)
        touched = pin.SE3(contact.rotation, center - limb.radius * contact.normal)
        offset = Placement.of(effector.inverse() * touched)
    pose = Placement.of(pin.SE3(contact.rotation, contact.position))
    return ContactEntry(
        limb=limb.name,
        frame=limb.effector,
        frame_offset=_pose(offset),
        type="planar" if limb.planar else "point",
        position=_vector(contact.position),
        orientation=_quaternion(pose.orientation),
        normal=_vector(contact.normal),
        points=tuple(_vector(point) for point in contact.points),
        friction=contact.friction,
        surface=contact.surface,
        spot=limb.spots[contact.spot].name,
    )


def _pose(placement: Placement) -> Pose:
    return Pose(
        position=_vector(placement.position), orientation=_quaternion(placement.orientation)
    )


def _root_pose(root: Array) -> Pose:
    return Pose(position=_vector(root[:3]), orientation=_quaternion(root[3:7]))


def _guide_node(root: Array) -> GuideNode:
    pose = _root_pose(root)
    return GuideNode(
        position=pose.position, orientation=pose.orientation, joints=tuple(root[7:].tolist())
    )


def _vector(array: Array) -> Vector3:
    x, y, z = array.tolist()
    return (x, y, z)


def _quaternion(array: Array) -> tuple[float, float, float, float]:
    x, y, z, w = array.tolist()
    return (x, y, z, w)
