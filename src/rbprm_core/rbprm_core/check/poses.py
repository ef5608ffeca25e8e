"""Poses, angles and unit vectors of a plan, and quaternions and normals that are not unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from rbprm_core.arrays import Array
from rbprm_core.check.violation import PLAN, Kind, Violation
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan, Pose, Quaternion, StateEntry, Vector3

UNIT_TOLERANCE = 1e-3  # a pose may have been stored in single precision
MIN_NORM = 1e-6  # smaller quaternions define no orientation
MAX_COORDINATE = 1e6  # metres; products of larger coordinates lose the millimetre


def transform(position: Vector3, orientation: Quaternion, field: str) -> pin.SE3:
    """Return the transform of a pose, with its quaternion normalised.

    Args:
        position: (3,) position, metres.
        orientation: (4,) quaternion [x, y, z, w].
        field: name of the pose in errors.

    Raises:
        InvalidInput: the quaternion is zero, or a number is not finite or too large.
    """
    norm = float(np.linalg.norm(orientation))
    if not np.abs([*position, norm]).max() < MAX_COORDINATE or norm < MIN_NORM:
        reason = "is not a pose: the quaternion is zero, or a number is not finite or too large"
        raise InvalidInput(field, (position, orientation), reason)
    rotation = pin.Quaternion(np.array(orientation) / norm).matrix()
    return pin.SE3(rotation, np.array(position, dtype=float))


def pose_transform(pose: Pose, field: str) -> pin.SE3:
    """Return the transform of a pose, with its quaternion normalised.

    Args:
        pose: position in metres and quaternion [x, y, z, w].
        field: name of the pose in errors.

    Raises:
        InvalidInput: see `transform`.
    """
    return transform(pose.position, pose.orientation, field)


def angle_between(a: ArrayLike, b: ArrayLike) -> float:
    """Return the angle between two vectors (3,), radians; pi/2 if one of them is zero.

    Unlike the arc cosine it is accurate near 0 and pi.

    Args:
        a: (3,) vector of any length.
        b: (3,) vector of any length.
    """
    u, v = np.array(a, dtype=float), np.array(b, dtype=float)
    cosine, sine = float(u @ v), float(np.linalg.norm(np.cross(u, v)))
    return float(np.arctan2(sine, cosine)) if sine or cosine else np.pi / 2


def unit(vector: ArrayLike) -> Array:
    """Return a vector (3,) scaled to length 1; a zero vector stays zero.

    Args:
        vector: (3,) vector of any length.
    """
    array = np.array(vector, dtype=float)
    norm = float(np.linalg.norm(array))
    return array / norm if norm > 0 else array


def plan_quaternion_violations(plan: ContactPlan) -> Iterator[Violation]:
    """Yield the quaternions of the request and of the guide that are not unit.

    Args:
        plan: plan to check.
    """
    poses = {"request.start": plan.request.start, "request.goal": plan.request.goal}
    poses |= {f"guide.{i}": pose for i, pose in enumerate(plan.guide)}
    for name, pose in poses.items():
        yield from _unless_unit(PLAN, "", name, pose.orientation)


def state_quaternion_violations(state: StateEntry, index: int) -> Iterator[Violation]:
    """Yield the quaternions and normals of a state that are not unit.

    Args:
        state: state of the plan.
        index: its index.
    """
    yield from _unless_unit(index, "", "root", state.root.orientation)
    for contact in state.contacts:
        yield from _unless_unit(index, contact.limb, "contact", contact.orientation)
        offset = contact.frame_offset.orientation
        yield from _unless_unit(index, contact.limb, "frame offset", offset)
        length = float(np.linalg.norm(contact.normal))
        if abs(length - 1) > UNIT_TOLERANCE:
            text = f"contact normal has length {length:.4g} (must be 1)"
            yield Violation(index, contact.limb, Kind.UNIT_NORMAL, text)


def _unless_unit(state: int, limb: str, owner: str, quaternion: Quaternion) -> Iterator[Violation]:
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1) > UNIT_TOLERANCE:
        text = f"quaternion of the {owner} has norm {norm:.4g} (must be 1)"
        yield Violation(state, limb, Kind.QUATERNION, text)
