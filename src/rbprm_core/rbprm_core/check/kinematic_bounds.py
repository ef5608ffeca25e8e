"""Kinematic bounds: joint limits, centre of mass, poses and points of contacts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.check.poses import pose_transform, transform, unit
from rbprm_core.check.robot_model import FIRST_JOINT, Robot
from rbprm_core.check.violation import PLAN, Kind, Violation
from rbprm_core.plan_record import ContactEntry, StateEntry

LIMIT_SLACK = 1e-6  # rad or m; a joint at its limit may have been rounded in the file
POSITION_BOUND = 1.5e-3  # metres between the declared and the actual contact frame
ANGLE_BOUND = np.deg2rad(0.6)  # radians between the declared and the actual contact frame
COM_BOUND = 1e-3  # metres between the declared and the actual centre of mass
POINT_BOUND = 1e-4  # metres between a point contact's point and its position, which are equal


def joint_order_violations(robot: Robot) -> Iterator[Violation]:
    """Yield a violation if the joint names are not in the order of the URDF.

    Args:
        robot: robot of the plan.
    """
    expected = tuple(robot.model.names[FIRST_JOINT:])
    if robot.joint_names != expected:
        text = f"joint names are not in the URDF's order, which is {', '.join(expected)}"
        yield Violation(PLAN, "", Kind.JOINT_ORDER, text)


def joint_limit_violations(robot: Robot, state: StateEntry, index: int) -> Iterator[Violation]:
    """Yield the joints outside the limits of the URDF.

    Args:
        robot: robot of the plan.
        state: state of the plan.
        index: its index.
    """
    lower, upper = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
    for name, value in zip(robot.joint_names, state.joints, strict=True):
        k = robot.model.joints[robot.model.getJointId(name)].idx_q
        if not lower[k] - LIMIT_SLACK <= value <= upper[k] + LIMIT_SLACK:
            text = f"joint {name} at {value:.6g} (limits {lower[k]:.6g} to {upper[k]:.6g})"
            yield Violation(index, "", Kind.JOINT_LIMIT, text)


def com_violations(robot: Robot, state: StateEntry, index: int) -> Iterator[Violation]:
    """Yield a violation if the declared centre of mass is not that of the placed robot.

    Args:
        robot: robot, placed at the state.
        state: state of the plan.
        index: its index.
    """
    error = float(np.linalg.norm(robot.com - state.com))
    if error > COM_BOUND:
        text = f"declared centre of mass {_mm(error)} from the URDF's (at most {_mm(COM_BOUND)})"
        yield Violation(index, "", Kind.COM, text)


def contact_pose_violations(
    robot: Robot, contact: ContactEntry, index: int, field: str
) -> Iterator[Violation]:
    """Yield violations if the declared contact frame is not that of the placed robot.

    The orientation is checked for planar contacts only.

    Args:
        robot: robot, placed at the state of the contact.
        contact: contact of the state.
        index: index of the state.
        field: name of the contact in errors.
    """
    frame = robot.data.oMf[robot.frame(contact.frame, f"{field}.frame")]
    reached = frame * pose_transform(contact.frame_offset, f"{field}.frame_offset")
    declared = transform(contact.position, contact.orientation, field)
    error = float(np.linalg.norm(reached.translation - declared.translation))
    if error > POSITION_BOUND:
        text = f"contact frame {_mm(error)} from the declared one (at most {_mm(POSITION_BOUND)})"
        yield Violation(index, contact.limb, Kind.CONTACT_POSE, text)
    angle = float(np.linalg.norm(pin.log3(reached.rotation.T @ declared.rotation)))
    if contact.type == "planar" and angle > ANGLE_BOUND:
        text = f"contact frame turned by {_deg(angle)} (at most {_deg(ANGLE_BOUND)})"
        yield Violation(index, contact.limb, Kind.CONTACT_POSE, text)


def contact_point_violations(contact: ContactEntry, index: int) -> Iterator[Violation]:
    """Yield violations if the points of a contact do not fit its declared pose.

    The point of a point contact is its position. The corners of a planar contact lie in the plane
    through the position that is perpendicular to the normal, and surround the position.

    Args:
        contact: contact of a state.
        index: index of the state.
    """
    wanted = 1 if contact.type == "point" else 4
    if len(contact.points) != wanted:
        text = f"{len(contact.points)} points ({wanted} for a {contact.type} contact)"
        yield Violation(index, contact.limb, Kind.CONTACT_POINTS, text)
        return
    offsets = np.array(contact.points) - contact.position
    if contact.type == "point":
        error, bound = float(np.linalg.norm(offsets)), POINT_BOUND
        text = f"contact point {_mm(error)} from the contact's position (at most {_mm(bound)})"
    else:
        error, bound = float(np.abs(offsets @ unit(contact.normal)).max()), POSITION_BOUND
        text = f"corner {_mm(error)} off the plane of the contact (at most {_mm(bound)})"
    if error > bound:
        yield Violation(index, contact.limb, Kind.CONTACT_POINTS, text)
    elif contact.type == "planar" and not _surround_origin(offsets, unit(contact.normal)):
        text = "the four corners do not surround the contact's position"
        yield Violation(index, contact.limb, Kind.CONTACT_POINTS, text)


def _surround_origin(offsets: Array, normal: Array) -> bool:
    """Return whether corners (4, 3), in either sense of rotation, go once around the origin."""
    turns = np.cross(offsets, np.roll(offsets, -1, axis=0)) @ normal
    return bool((turns > 0).all() or (turns < 0).all())


def _mm(length: float) -> str:
    return f"{1e3 * length:.1f} mm"


def _deg(angle: float) -> str:
    return f"{np.rad2deg(angle):.2f} deg"
