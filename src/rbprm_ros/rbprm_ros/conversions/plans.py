"""Conversion of contact plans to messages, and back."""

from __future__ import annotations

import math

from geometry_msgs.msg import Point, PoseStamped, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from nav_msgs.msg import Path
from rbprm_msgs.msg import Contact, ContactSequence, ContactState, PlanStatistics, StageTime
from std_msgs.msg import Header

from rbprm_core.check import count_transitions, missing_goal_limbs
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_conversion.states_to_plan import transition_entries, with_states
from rbprm_core.plan_record import (
    GRIP_FORCE,
    ContactEntry,
    ContactPlan,
    EnvironmentEntry,
    GuideNode,
    Pose,
    RequestEntry,
    RobotEntry,
    StateEntry,
    Statistics,
)
from rbprm_core.request import END_TOLERANCE
from rbprm_core.stages import TIMED
from rbprm_core.validation import (
    MAX_FRICTION,
    finite_array,
    finite_number,
    naming_fields,
    parse_record,
)
from rbprm_ros.conversions.geometry import (
    placement_of_message,
    pose_message,
    pose_of_message,
    time_message,
    triple,
    vector_message,
)

TYPES = {"point": Contact.TYPE_POINT, "planar": Contact.TYPE_PLANAR}
TYPE_NAMES = {number: name for name, number in TYPES.items()}
FIELDS = {f"gravity.{i}": f"sequence.gravity.{axis}" for i, axis in enumerate("xyz")}
"""Fields of a validated sequence by those of a `RequestEntry`, where they differ."""
MAX_POINTS = 16  # largest number of points of a contact; a patch has four


def sequence_message(
    plan: ContactPlan,
    header: Header,
    sequence_id: str,
    surfaces_stamp: int,
    *,
    revision: int = 0,
    first_changed: int = 0,
    complete: bool = True,
) -> ContactSequence:
    """The message of a plan as a revision of a sequence, by default the first one.

    Args:
        plan: the plan.
        header: header of the message.
        sequence_id: identifier of the sequence.
        surfaces_stamp: stamp of the newest surfaces that it was planned on, nanoseconds.
        revision: number of the revision.
        first_changed: index of the first state that differs from the revision before.
        complete: True where the last state is at the goal.
    """
    request = plan.request
    return ContactSequence(
        header=header,
        sequence_id=sequence_id,
        revision=revision,
        first_changed_state=first_changed,
        robot=plan.robot.name,
        urdf=plan.robot.urdf,
        srdf=plan.robot.srdf or "",
        joint_names=list(plan.robot.joint_names),
        surfaces_stamp=time_message(surfaces_stamp),
        start=_pose_message(request.start),
        goal=_pose_message(request.goal),
        seed=request.seed,
        robustness_threshold=request.robustness_threshold,
        gravity=vector_message(Vector3, request.gravity),
        grip_force=request.grip_force,
        position_tolerance=request.position_tolerance,
        orientation_tolerance=request.orientation_tolerance,
        guide_planner=request.stages.guide,
        contact_planner=request.stages.contacts,
        goal_limbs=list(request.goal_limbs or ()),
        missing_goal_limbs=list(missing_goal_limbs(plan)) if plan.states else [],
        complete=complete,
        states=[_state_message(i, state) for i, state in enumerate(plan.states)],
    )


def guide_message(plan: ContactPlan, header: Header) -> Path:
    """The message of a plan's guide path.

    Args:
        plan: the plan.
        header: header in the planning frame.
    """
    poses = [PoseStamped(header=header, pose=_pose_message(pose)) for pose in plan.guide]
    return Path(header=header, poses=poses)


def statistics_message(plan: ContactPlan) -> PlanStatistics:
    """The message of a plan's times and counts.

    Args:
        plan: the plan.
    """
    time, counts = plan.statistics.time, plan.statistics.counts
    return PlanStatistics(
        times=[
            StageTime(stage=stage, seconds=seconds)
            for stage, seconds in time.items()
            if stage in TIMED
        ],
        time_total=time.get("total", 0.0),
        guides=counts.get("guides", 0),
        guide_nodes=counts.get("guide_nodes", 0),
        guide_waypoints=len(plan.guide),
        states=len(plan.states),
        contact_transitions=count_transitions(plan),
        min_robustness=min((state.robustness for state in plan.states), default=math.nan),
    )


def plan_of_messages(
    sequence: ContactSequence,
    guide: Path,
    environment: EnvironmentEntry,
    statistics: PlanStatistics | None = None,
) -> ContactPlan:
    """The plan of messages from a planner, to be saved, shown and checked.

    Args:
        sequence: the sequence.
        guide: its guide path.
        environment: environment of the plan: the surfaces that were sent, or their meshes.
        statistics: statistics in the answer to the call; None for a sequence from a topic.

    Raises:
        InvalidInput: an invalid request, see `read_sequence`.
        pydantic.ValidationError: another invalid field.
    """
    states = tuple(_state_entry(state) for state in sequence.states)
    return ContactPlan(
        robot=RobotEntry(
            name=sequence.robot,
            urdf=sequence.urdf,
            srdf=sequence.srdf or None,
            joint_names=tuple(sequence.joint_names),
        ),
        environment=environment,
        request=_request_entry(sequence),
        guide=tuple(_guide_node(stamped.pose) for stamped in guide.poses),
        states=states,
        transitions=transition_entries(states),
        statistics=Statistics() if statistics is None else _statistics(statistics),
    )


def read_sequence(message: ContactSequence, max_states: int, limbs: int) -> ContactPlan:
    """The validated plan of a sequence from any sender, without environment and guide.

    Args:
        message: the sequence.
        max_states: maximum number of its states.
        limbs: number of the robot's limbs.

    Raises:
        InvalidInput: names the invalid field.
    """
    if len(message.states) > max_states:
        reason = f"are too many; the parameter max_states is {max_states}"
        raise InvalidInput("sequence.states", f"{len(message.states)} states", reason)
    states = tuple(
        read_state(state, f"sequence.states.{i}", limbs) for i, state in enumerate(message.states)
    )
    for field in ("start", "goal"):
        placement_of_message(getattr(message, field), f"sequence.{field}")
    bare = ContactSequence(
        robot=message.robot, urdf=message.urdf, srdf=message.srdf, joint_names=message.joint_names,
        start=message.start, goal=message.goal, seed=message.seed, gravity=message.gravity,
        robustness_threshold=message.robustness_threshold, grip_force=message.grip_force,
        position_tolerance=message.position_tolerance,
        orientation_tolerance=message.orientation_tolerance,
    )  # fmt: skip
    with naming_fields(FIELDS, "sequence."):
        plan = plan_of_messages(bare, Path(), EnvironmentEntry())
    return with_states(plan, states)


def read_state(message: ContactState, field: str, limbs: int) -> StateEntry:
    """The validated state of a message from any sender.

    Args:
        message: the state.
        field: field of the message that holds the state, for errors.
        limbs: number of the robot's limbs; each has one contact at most.

    Raises:
        InvalidInput: names the invalid field.
    """
    if len(message.contacts) > limbs:
        reason = f"are too many: each of the robot's {limbs} limbs has one at most"
        raise InvalidInput(f"{field}.contacts", f"{len(message.contacts)} contacts", reason)
    placement_of_message(message.root, f"{field}.root")
    finite_array(f"{field}.joint_positions", message.joint_positions, (-1,))
    for k, contact in enumerate(message.contacts):
        place = f"{field}.contacts.{k}"
        if contact.type not in TYPE_NAMES:
            reason = f"must be one of {tuple(TYPE_NAMES)}: point, planar"
            raise InvalidInput(f"{place}.type", contact.type, reason)
        placement_of_message(contact.pose, f"{place}.pose")
        placement_of_message(contact.frame_offset, f"{place}.frame_offset")
        finite_array(f"{place}.normal", triple(contact.normal), (3,))
        if len(contact.points) > MAX_POINTS:
            reason = f"are too many: at most {MAX_POINTS}"
            raise InvalidInput(f"{place}.points", f"{len(contact.points)} points", reason)
        for n, point in enumerate(contact.points):
            finite_array(f"{place}.points.{n}", triple(point), (3,))
        finite_number(f"{place}.friction", contact.friction, low=0.0, high=MAX_FRICTION)
    finite_array(f"{field}.com", triple(message.com), (3,))
    finite_number(f"{field}.robustness", message.robustness)
    return _state_entry(message)


def _request_entry(message: ContactSequence) -> RequestEntry:
    """The request of a sequence, as far as the message holds it."""
    fields = {
        "start": pose_of_message(message.start),
        "goal": pose_of_message(message.goal),
        "seed": message.seed,
        "robustness_threshold": message.robustness_threshold,
        "gravity": triple(message.gravity),
        "grip_force": message.grip_force or GRIP_FORCE,
        "goal_limbs": tuple(message.goal_limbs) or None,
        "position_tolerance": message.position_tolerance or END_TOLERANCE,
        "orientation_tolerance": message.orientation_tolerance or END_TOLERANCE,
        "stages": {
            name: value
            for name, value in (
                ("guide", message.guide_planner),
                ("contacts", message.contact_planner),
            )
            if value
        },
    }
    return parse_record(RequestEntry, fields)


def _guide_node(message: PoseMessage) -> GuideNode:
    pose = pose_of_message(message)
    return GuideNode(position=pose.position, orientation=pose.orientation)


def _statistics(message: PlanStatistics) -> Statistics:
    return Statistics(
        time={entry.stage: entry.seconds for entry in message.times}
        | {"total": message.time_total},
        counts={
            "guides": message.guides,
            "guide_nodes": message.guide_nodes,
            "states": message.states,
        },
    )


def _pose_message(pose: Pose) -> PoseMessage:
    return pose_message(pose.position, pose.orientation)


def _state_message(index: int, state: StateEntry) -> ContactState:
    return ContactState(
        index=index,
        root=_pose_message(state.root),
        joint_positions=list(state.joints),
        com=vector_message(Point, state.com),
        robustness=state.robustness,
        contacts=[_contact_message(contact) for contact in state.contacts],
    )


def _contact_message(contact: ContactEntry) -> Contact:
    return Contact(
        limb=contact.limb,
        spot=contact.spot,
        frame=contact.frame,
        type=TYPES[contact.type],
        pose=pose_message(contact.position, contact.orientation),
        frame_offset=_pose_message(contact.frame_offset),
        normal=vector_message(Vector3, contact.normal),
        points=[vector_message(Point, point) for point in contact.points],
        friction=contact.friction,
        surface_id=contact.surface,
    )


def _state_entry(message: ContactState) -> StateEntry:
    return StateEntry(
        root=pose_of_message(message.root),
        joints=tuple(message.joint_positions),
        com=triple(message.com),
        robustness=message.robustness,
        contacts=tuple(_contact_entry(contact) for contact in message.contacts),
    )


def _contact_entry(message: Contact) -> ContactEntry:
    pose = pose_of_message(message.pose)
    return ContactEntry(
        limb=message.limb,
        spot=message.spot,
        frame=message.frame,
        frame_offset=pose_of_message(message.frame_offset),
        type=TYPE_NAMES[message.type],  # type: ignore[arg-type]
        position=pose.position,
        orientation=pose.orientation,
        normal=triple(message.normal),
        points=tuple(triple(point) for point in message.points),
        friction=message.friction,
        surface=message.surface_id,
    )
