"""Conversion between plan requests and their messages."""

from __future__ import annotations

import uuid
from dataclasses import replace

import numpy as np
from geometry_msgs.msg import Point, PoseStamped, Vector3
from numpy.typing import NDArray
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import RootBounds as BoundsMessage
from rbprm_msgs.srv import Plan, Replan
from std_msgs.msg import Header

from rbprm_core.errors import InvalidInput
from rbprm_core.guide.root_bounds import derived_bounds
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.plan_record import GRIP_FORCE, StateEntry
from rbprm_core.replanning import root_placement
from rbprm_core.request import GRAVITY, PlanRequest, StageNames
from rbprm_core.robot import Robot, known_robots
from rbprm_core.validation import naming_fields, one_of
from rbprm_ros.conversions.geometry import (
    placement_of_message,
    pose_message,
    require_frame,
    triple,
    vector_message,
)
from rbprm_ros.conversions.plans import read_state
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.environment.store import Environment
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, RobotChoice

Array = NDArray[np.float64]

UNSET_BOUNDS = BoundsMessage()
FIELDS = {
    "start": "start.pose",
    "goal": "goal.pose",
    **{f"bounds.{axis}": "bounds.low" for axis in "xyz"},
    **{f"bounds.{axis}.1": "bounds.high" for axis in "xyz"},
    **{f"bounds.{axis}.0": "bounds.low" for axis in "xyz"},
    **{f"gravity.{i}": f"gravity.0.{axis}" for i, axis in enumerate("xyz")},
    "stages.guide": "guide_planner",
    "stages.contacts": "contact_planner",
}
"""Fields of Plan and PlanContacts by those of a `PlanRequest`, where they differ."""


def job_of_message(
    message: Plan.Request | PlanContacts.Goal, settings: Settings, environment: Environment
) -> Job:
    """The job of a call or a goal, on the surfaces as they are now.

    Args:
        message: request of the call, or the goal.
        settings: parameters of the node.
        environment: environment with its newest surfaces.

    Raises:
        InvalidInput: names the field at fault; `surfaces` if there are none.
    """
    start = _placement(message.start, settings, "start")
    goal = _placement(message.goal, settings, "goal")
    known = tuple(dict.fromkeys((*known_robots(), settings.robot)))
    robot = one_of("robot", message.robot or settings.robot, known)
    choice = RobotChoice(robot, tuple(message.limbs), tuple(message.root_joints))
    limbs = _chosen_limbs(choice)
    snapshot = environment.snapshot
    _require_surfaces(snapshot, environment.rejection)
    given = message.bounds != UNSET_BOUNDS
    request = PlanRequest(
        start=start,
        goal=goal,
        bounds=(
            _bounds(message.bounds)
            if given
            else derived_bounds([start, goal], snapshot.surfaces, settings.bounds)
        ),
        required_limbs=tuple(message.required_limbs) or limbs,
        start_limbs=tuple(message.start_limbs) or limbs,
        robustness_threshold=message.robustness_threshold or settings.robustness_threshold,
        goal_limbs=tuple(message.goal_limbs) or None,
        seed=message.seed,
        gravity=np.array(triple(message.gravity[0])) if message.gravity else GRAVITY.copy(),
        grip_force=message.grip_force or GRIP_FORCE,
        options=settings.planner,
        stages=StageNames(
            message.guide_planner or settings.stages.guide,
            message.contact_planner or settings.stages.contacts,
        ),
        time_limit=message.time_limit or settings.time_limit,
    )
    with naming_fields(FIELDS):
        request = request.validated(limbs)
    return Job(
        uuid.uuid4().hex, choice, request, message.time_limit or settings.time_limit, snapshot,
        bounds_derived=not given, keep_roadmaps=settings.keep_roadmaps,
    )  # fmt: skip


def replan_job_of_message(
    message: Replan.Request,
    base: PublishedSequence,
    default_from: int,
    settings: Settings,
    environment: Environment,
) -> Job:
    """The job of a replan call.

    Args:
        message: request of the call.
        base: the published sequence.
        default_from: index of the state to go on from where the call leaves it to the node.
        settings: parameters of the node.
        environment: environment with its newest surfaces.

    Raises:
        InvalidInput: names the field at fault; `surfaces` if there are none.
    """
    snapshot = environment.snapshot
    _require_surfaces(snapshot, environment.rejection)
    limbs = tuple(limb.name for limb in base.job.robot.description().limbs)
    kept, measured = _kept(message, base, default_from, len(limbs))
    request = base.job.request
    goal = _placement(message.goal[0], settings, "goal.0") if message.goal else request.goal
    bounds = request.bounds
    if base.job.bounds_derived:
        places = [request.start, goal, root_placement(kept[-1])]
        bounds = derived_bounds(places, snapshot.surfaces, settings.bounds)
    request = replace(
        request,
        goal=goal,
        bounds=bounds,
        seed=message.seed,
        options=settings.planner,
        time_limit=message.time_limit or settings.time_limit,
    )
    if message.goal or message.goal_limbs:
        request = replace(request, goal_limbs=tuple(message.goal_limbs) or None)
    with naming_fields(FIELDS):
        request = request.validated(limbs)
    return Job(
        uuid.uuid4().hex, base.job.robot, request, message.time_limit or settings.time_limit,
        snapshot, kept, measured=measured, bounds_derived=base.job.bounds_derived,
        keep_roadmaps=settings.keep_roadmaps,
    )  # fmt: skip


def _kept(
    message: Replan.Request, base: PublishedSequence, default_from: int, limbs: int
) -> tuple[tuple[StateEntry, ...], bool]:
    """The states that stay, and True where it is a measured one."""
    states = base.plan.states
    if message.measured_state:
        state = read_state(message.measured_state[0], "measured_state.0", limbs)
        if len(state.joints) != len(base.plan.robot.joint_names):
            reason = f"must have {len(base.plan.robot.joint_names)} values, as joint_names has"
            field = "measured_state.0.joint_positions"
            raise InvalidInput(field, list(state.joints), reason)
        return (state,), True
    index = default_from if message.from_state == -1 else message.from_state
    if not 0 <= index < len(states):
        reason = f"must be -1 or an index of the sequence, which has {len(states)} states"
        raise InvalidInput("from_state", index, reason)
    return states[: index + 1], False


def request_message(
    request: PlanRequest, robot: str, time_limit: float, frame: str = ""
) -> Plan.Request:
    """The message of a request.

    Args:
        request: the request.
        robot: name of the robot; "" for the node's own.
        time_limit: longest planning time, seconds; 0 for the node's own.
        frame: frame of the poses; "" for the planning frame.
    """
    bounds = request.bounds
    yaw, pitch, roll = bounds.half_ranges.tolist()
    return Plan.Request(
        robot=robot,
        start=_stamped(request.start, frame),
        goal=_stamped(request.goal, frame),
        bounds=BoundsMessage(
            low=vector_message(Point, bounds.low),
            high=vector_message(Point, bounds.high),
            yaw=yaw,
            pitch=pitch,
            roll=roll,
        ),
        goal_limbs=list(request.goal_limbs or ()),
        required_limbs=list(request.required_limbs),
        start_limbs=list(request.start_limbs),
        seed=request.seed,
        time_limit=time_limit,
        robustness_threshold=request.robustness_threshold,
        gravity=[vector_message(Vector3, request.gravity)],
        grip_force=request.grip_force,
        guide_planner=request.stages.guide,
        contact_planner=request.stages.contacts,
    )


def _chosen_limbs(choice: RobotChoice) -> tuple[str, ...]:
    """Names of the limbs that are chosen for a robot.

    Raises:
        InvalidInput: `limbs`, or `root_joints.i` of a joint that cannot be planned with the root.
    """
    description = choice.description()
    if choice.root_joints:
        try:
            Robot.load(description)
        except InvalidInput as error:
            if error.field != "robot.root_joints":
                raise
            i = len(choice.root_joints) - 1 - choice.root_joints[::-1].index(error.value)
            raise InvalidInput(f"root_joints.{i}", error.value, error.reason) from error
    return tuple(limb.name for limb in description.limbs)


def _placement(message: PoseStamped, settings: Settings, field: str) -> Placement:
    require_frame(message.header, settings.planning_frame, f"{field}.header")
    return placement_of_message(message.pose, f"{field}.pose")


def _stamped(placement: Placement, frame: str) -> PoseStamped:
    pose = pose_message(placement.position, placement.orientation)
    return PoseStamped(header=Header(frame_id=frame), pose=pose)


def _bounds(message: BoundsMessage) -> RootBounds:
    low, high = (np.array(triple(corner)) for corner in (message.low, message.high))
    return RootBounds(low, high, np.array([message.yaw, message.pitch, message.roll]))


def _require_surfaces(snapshot: Snapshot, rejection: str) -> None:
    if snapshot.surfaces:
        return
    what = "the newest message removed all" if snapshot.version else "none were received"
    hint = f"; the newest message was refused: {rejection}" if rejection else ""
    raise InvalidInput("surfaces", [], f"{what}: publish some on ~/surfaces first{hint}")
