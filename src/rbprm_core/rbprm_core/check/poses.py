"""Poses of a plan as transforms, and the quaternions that are none."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from rbprm_core.check.report import PLAN, Kind, Violation
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan, Pose, Quaternion, StateEntry, Vector3

UNIT_TOLERANCE = 1e-3  # a pose may have passed through single precision
MIN_NORM = 1e-6
MAX_COORDINATE = 1e6  # metres; nothing of a millimetre is left in products of larger coordinates


def transform(position: Vector3, orientation: Quaternion, field: str) -> pin.SE3:
    """Transform of a position in metres and a quaternion [x, y, z, w], which is normalised.

    Raises:
        InvalidInput: a quaternion or a position that stands for no pose.
    """
    norm = float(np.linalg.norm(orientation))
    if not np.abs([*position, norm]).max() < MAX_COORDINATE or norm < MIN_NORM:
        raise InvalidInput(field, (position, orientation), "is no pose")
    rotation = pin.Quaternion(np.array(orientation) / norm).matrix()
    return pin.SE3(rotation, np.array(position, dtype=float))


def pose_transform(pose: Pose, field: str) -> pin.SE3:
    """Transform of a pose; see `transform`."""
    return transform(pose.position, pose.orientation, field)


def angle_between(a: ArrayLike, b: ArrayLike) -> float:
    """Angle of two vectors (3,), radians, accurate near 0 and pi; pi/2 for a zero vector."""
    u, v = np.array(a, dtype=float), np.array(b, dtype=float)
    cosine, sine = float(u @ v), float(np.linalg.norm(np.cross(u, v)))
    return float(np.arctan2(sine, cosine)) if sine or cosine else np.pi / 2


def unit(vector: ArrayLike) -> NDArray[np.float64]:
    """Vector (3,) scaled to length 1; a zero vector stays zero."""
    array = np.array(vector, dtype=float)
    norm = float(np.linalg.norm(array))
    return array / norm if norm > 0 else array


def plan_quaternions(plan: ContactPlan) -> Iterator[Violation]:
    """Quaternions of the request and of the guide that are not unit."""
    poses = {"request.start": plan.request.start, "request.goal": plan.request.goal}
    poses |= {f"guide.{i}": pose for i, pose in enumerate(plan.guide)}
    for name, pose in poses.items():
        yield from _not_unit(PLAN, "", name, pose.orientation)


def state_quaternions(state: StateEntry, index: int) -> Iterator[Violation]:
    """Quaternions and normals of a state that are not unit."""
    yield from _not_unit(index, "", "root", state.root.orientation)
    for contact in state.contacts:
        yield from _not_unit(index, contact.limb, "contact", contact.orientation)
        offset = contact.frame_offset.orientation
        yield from _not_unit(index, contact.limb, "frame offset", offset)
        length = float(np.linalg.norm(contact.normal))
        if abs(length - 1) > UNIT_TOLERANCE:
            text = f"contact normal has length {length:.4g} (must be 1)"
            yield Violation(index, contact.limb, Kind.UNIT_NORMAL, text)


def _not_unit(state: int, limb: str, what: str, quaternion: Quaternion) -> Iterator[Violation]:
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1) > UNIT_TOLERANCE:
        text = f"quaternion of the {what} has norm {norm:.4g} (must be 1)"
        yield Violation(state, limb, Kind.QUATERNION, text)
