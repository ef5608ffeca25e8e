"""From the planner's outcome to the contact plan."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.transition import Action, contact_action
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
    TransitionEntry,
    Vector3,
)
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.validation import MAX_FORCE


def contact_plan(
    outcome: Outcome, request: PlanRequest, robot: Robot, environment: EnvironmentEntry
) -> ContactPlan:
    """The contact plan of what the planner found.

    Args:
        outcome: guide, states and statistics.
        request: the request that was planned.
        robot: the robot.
        environment: the environment that was planned in.
    """
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
    """The states found before planning failed, as a plan that stops short of the goal.

    Args:
        error: the failure, with the states.
        request: the request that was planned.
        robot: the robot.
        environment: the environment that was planned in.

    Returns:
        A plan without a guide; None where no state was found.
    """
    if not error.states:
        return None
    plan = bare_plan([state_entry(robot, state) for state in error.states], request, robot)
    statistics = Statistics() if error.statistics is None else error.statistics
    return plan.model_copy(update={"environment": environment, "statistics": statistics})


def bare_plan(states: Iterable[StateEntry], request: PlanRequest, robot: Robot) -> ContactPlan:
    """A plan of some states, without environment, guide and statistics.

    Args:
        states: the states.
        request: the request that was planned.
        robot: the robot.
    """
    states = tuple(states)
    return ContactPlan(
        robot=robot_entry(robot),
        environment=EnvironmentEntry(),
        request=request.entry(),
        guide=(),
        states=states,
        transitions=transition_entries(states),
        statistics=Statistics(),
    )


def with_states(plan: ContactPlan, states: Sequence[StateEntry]) -> ContactPlan:
    """The plan with other states, and the transitions between them.

    Args:
        plan: the plan.
        states: its new states.
    """
    changed = {"states": tuple(states), "transitions": transition_entries(states)}
    return plan.model_copy(update=changed)


def transition_entries(states: Sequence[StateEntry]) -> tuple[TransitionEntry, ...]:
    """The transitions between neighbouring states, without witnesses.

    Args:
        states: states of a plan, whose neighbours differ by one contact at most.
    """
    return tuple(_transition(before, after) for before, after in pairwise(states))


def _transition(before: StateEntry, after: StateEntry) -> TransitionEntry:
    """The first change of a contact in the order of the limbs' names; of a valid plan, the only."""
    old = {contact.limb: contact.position for contact in before.contacts}
    new = {contact.limb: contact.position for contact in after.contacts}
    for limb in sorted({*old, *new}):
        action = contact_action(old.get(limb), new.get(limb))
        if action is not Action.NONE:
            return TransitionEntry(limb=limb, action=action.value)  # type: ignore[arg-type]
    return TransitionEntry()


def robot_entry(robot: Robot) -> RobotEntry:
    """The robot as a plan holds it, with all choices of limbs, heuristics, surfaces and trunk.

    Args:
        robot: the robot.
    """
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
    """A state as a plan holds it, with the contact frames in the frames of their links.

    Args:
        robot: the robot.
        state: the state.
    """
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
        # A ball rolls about its centre: the contact point on it follows from the normal.
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
