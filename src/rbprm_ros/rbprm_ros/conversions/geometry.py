"""Points, vectors, quaternions, poses and times."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from std_msgs.msg import Header

from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.plan_record import Pose

Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]
Vector = TypeVar("Vector", Point, Vector3)

NANOSECONDS = 1_000_000_000  # of a second


def triple(message: Point | Vector3) -> Triple:
    """Coordinates of a point or vector."""
    return (message.x, message.y, message.z)


def quadruple(message: Quaternion) -> Quadruple:
    """Quaternion [x, y, z, w]."""
    return (message.x, message.y, message.z, message.w)


def vector_message(kind: type[Vector], values: Iterable[float]) -> Vector:
    """A point or vector of three numbers."""
    x, y, z = map(float, values)
    return kind(x=x, y=y, z=z)


def pose_message(position: Iterable[float], orientation: Iterable[float]) -> PoseMessage:
    """A pose of a position and a quaternion [x, y, z, w]."""
    x, y, z, w = map(float, orientation)
    return PoseMessage(
        position=vector_message(Point, position), orientation=Quaternion(x=x, y=y, z=z, w=w)
    )


def pose_of_message(message: PoseMessage) -> Pose:
    """A pose in the words of the plan file."""
    return Pose(position=triple(message.position), orientation=quadruple(message.orientation))


def placement_of_message(message: PoseMessage, field: str) -> Placement:
    """A validated placement.

    Raises:
        InvalidInput: not finite, or not a unit quaternion.
    """
    return Placement.parse(triple(message.position), quadruple(message.orientation), field)


def nanoseconds_of(message: Time) -> int:
    """A time as nanoseconds."""
    return int(message.sec) * NANOSECONDS + int(message.nanosec)


def time_message(nanoseconds: int) -> Time:
    """A time of nanoseconds."""
    sec, nanosec = divmod(nanoseconds, NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def require_frame(header: Header, planning_frame: str, field: str) -> None:
    """Refuse a header that is not in the planning frame; "" counts as that frame.

    Raises:
        InvalidInput: another frame, or a stamp that is no time.
    """
    if header.frame_id not in ("", planning_frame):
        reason = f'must be the planning frame "{planning_frame}", or ""; nothing is transformed'
        raise InvalidInput(f"{field}.frame_id", header.frame_id, reason)
    if header.stamp.nanosec >= NANOSECONDS:
        reason = f"must be less than {NANOSECONDS}"
        raise InvalidInput(f"{field}.stamp.nanosec", header.stamp.nanosec, reason)
