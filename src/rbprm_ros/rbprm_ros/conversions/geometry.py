"""Conversion of points, vectors, quaternions, poses and times."""

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

NANOSECONDS = 1_000_000_000  # per second


def triple(message: Point | Vector3) -> Triple:
    """The coordinates (3,) of a point or vector.

    Args:
        message: a point or vector.
    """
    return (message.x, message.y, message.z)


def quadruple(message: Quaternion) -> Quadruple:
    """The quaternion [x, y, z, w] of a message.

    Args:
        message: a quaternion.
    """
    return (message.x, message.y, message.z, message.w)


def vector_message(kind: type[Vector], values: Iterable[float]) -> Vector:
    """A point or vector with three coordinates.

    Args:
        kind: class of the message.
        values: (3,) coordinates.
    """
    x, y, z = map(float, values)
    return kind(x=x, y=y, z=z)


def pose_message(position: Iterable[float], orientation: Iterable[float]) -> PoseMessage:
    """A pose with a position (3,), metres, and a quaternion [x, y, z, w].

    Args:
        position: (3,) metres.
        orientation: (4,) unit quaternion [x, y, z, w].
    """
    x, y, z, w = map(float, orientation)
    return PoseMessage(
        position=vector_message(Point, position), orientation=Quaternion(x=x, y=y, z=z, w=w)
    )


def pose_of_message(message: PoseMessage) -> Pose:
    """The pose of a message as a plan record holds it.

    Args:
        message: a pose, metres.
    """
    return Pose(position=triple(message.position), orientation=quadruple(message.orientation))


def placement_of_message(message: PoseMessage, field: str) -> Placement:
    """The validated placement of a message.

    Args:
        message: a pose.
        field: field of the message that holds the pose, for errors.

    Raises:
        InvalidInput: a value that is not finite, or a quaternion that is not a unit quaternion.
    """
    return Placement.parse(triple(message.position), quadruple(message.orientation), field)


def nanoseconds_of(message: Time) -> int:
    """The time of a message, nanoseconds.

    Args:
        message: a time.
    """
    return int(message.sec) * NANOSECONDS + int(message.nanosec)


def time_message(nanoseconds: int) -> Time:
    """The message of a time in nanoseconds.

    Args:
        nanoseconds: the time, nanoseconds.
    """
    sec, nanosec = divmod(nanoseconds, NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def require_frame(header: Header, planning_frame: str, field: str) -> None:
    """Refuse a header with another frame than the planning frame; "" stands for that frame.

    Args:
        header: the header.
        planning_frame: name of the planning frame.
        field: field of the message that holds the header, for errors.

    Raises:
        InvalidInput: another frame, or a stamp with too many nanoseconds.
    """
    if header.frame_id not in ("", planning_frame):
        reason = f'must be the planning frame "{planning_frame}", or ""; nothing is transformed'
        raise InvalidInput(f"{field}.frame_id", header.frame_id, reason)
    if header.stamp.nanosec >= NANOSECONDS:
        reason = f"must be less than {NANOSECONDS}"
        raise InvalidInput(f"{field}.stamp.nanosec", header.stamp.nanosec, reason)
