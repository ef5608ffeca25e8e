r"""Projection of a limb onto a contact: inverse kinematics of the limb's joints.

All functions here solve $e(q) = 0$ for a task error $e$ by damped Newton steps
$q \leftarrow q + J^T (J J^T + \lambda I)^{-1} e(q)$, where $J = -\partial e / \partial q$ and
$\lambda$ is the damping. After each step the joints are clipped to their limits. Rotational errors
are multiplied by a length, so that errors are in metres.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from rbprm_core.arrays import Array
from rbprm_core.robot.limb import Limb

TOLERANCE = 1e-5  # metres; a hundredth of the check's bound on plans
MAX_ITERATIONS = 12
DAMPING = 1e-6  # square metres; keeps steps finite near singularities
MAX_RATIO = 0.7
"""Largest ratio of the squared errors of successive steps; an error that shrinks more slowly does
not vanish within the iterations."""
ROTATION_LENGTH = 0.2  # metres per radian; weight of a rotational error
BASE_WEIGHT = 0.1  # metres per radian; motion of the base relative to that of the joints


def project(limb: Limb, start: Array, target: Array, rotation: Array | None = None) -> Array | None:
    """Limb joints (n,) that put the contact frame on a target, radians or metres.

    Args:
        limb: the limb.
        start: (n,) joints to start from, near the target.
        target: (3,) position of the contact frame in the limb's base frame, metres.
        rotation: (3, 3) rotation of the contact frame in the base frame; None where it is free.

    Returns:
        Joints inside the limits, or None where the target is not reached.
    """
    return _solve(limb.low, limb.high, start, lambda q: _task(limb, q, target, rotation))


def project_with_base(
    limb: Limb, start: Array, target: Array, rotation: Array | None, max_shift: float
) -> tuple[Array, Array] | None:
    """Limb joints (n,) and shift (3,) of the limb's base that put the contact frame on a target.

    It is for limbs whose joints alone cannot keep a contact while the base moves: a knee stays on a
    sphere about its hip.

    Args:
        limb: the limb.
        start: (n,) joints to start from, near the target.
        target: (3,) position of the contact frame in the unmoved base's frame, metres.
        rotation: (3, 3) rotation of the contact frame in the base frame; None where it is free.
        max_shift: largest length of the shift, metres.

    Returns:
        Joints inside the limits, radians or metres, and the shift in the base frame, metres; None
        where the target is not reached.
    """
    count = len(start)
    bound = np.full(3, max_shift / BASE_WEIGHT)
    low, high = np.concatenate([limb.low, -bound]), np.concatenate([limb.high, bound])

    def task(x: Array) -> tuple[Array, Array]:
        error, jacobian = _task(limb, x[:count], target - BASE_WEIGHT * x[count:], rotation)
        return error, np.hstack([jacobian, BASE_WEIGHT * np.eye(len(error), 3)])

    found = _solve(low, high, np.concatenate([start, np.zeros(3)]), task)
    if found is None:
        return None
    shift = BASE_WEIGHT * found[count:]
    return (found[:count], shift) if np.linalg.norm(shift) <= max_shift else None


def touch(limb: Limb, start: Array, normal: Array, offset: float) -> Array | None:
    r"""Limb joints (n,) that put the origin of the contact frame on a plane, radians or metres.

    Args:
        limb: the limb.
        start: (n,) joints to start from.
        normal: (3,) unit normal $n$ of the plane $n \cdot x = d$ in the limb's base frame.
        offset: offset $d$ of the plane, metres.

    Returns:
        Joints inside the limits, or None where the plane is not reached.
    """

    def task(q: Array) -> tuple[Array, Array]:
        position, jacobian = limb.kinematics.position_and_jacobian(q)
        return np.array([offset - normal @ position]), normal[None] @ jacobian

    return _solve(limb.low, limb.high, start, task)


def face(limb: Limb, start: Array, normal: Array) -> Array | None:
    """Limb joints (n,) that align the contact frame's z axis with a normal, radians or metres.

    Args:
        limb: the limb.
        start: (n,) joints to start from.
        normal: (3,) outward unit normal of a surface in the limb's base frame.

    Returns:
        Joints inside the limits, or None where the axis cannot be turned that far.
    """
    return _solve(limb.low, limb.high, start, lambda q: _facing_task(limb, q, normal))


def _solve(
    low: Array, high: Array, start: Array, task: Callable[[Array], tuple[Array, Array]]
) -> Array | None:
    """Joints (n,) inside the limits at which the error of a task vanishes; None without any.

    Args:
        low: (n,) lower limits.
        high: (n,) upper limits.
        start: (n,) joints to start from.
        task: function of the joints that returns the error (e,) and the Jacobian (e, n), metres.
    """
    q = start
    last = np.inf
    for i in range(MAX_ITERATIONS):
        error, jacobian = task(q)
        size = float(error @ error)
        if size < TOLERANCE * TOLERANCE:
            return q
        if i > 2 and size > MAX_RATIO * last:
            return None
        last = size
        gram = jacobian @ jacobian.T
        gram.flat[:: len(error) + 1] += DAMPING
        _, step, _ = dposv(gram, error)
        q = np.minimum(np.maximum(q + jacobian.T @ step, low), high)
    return None


def _task(limb: Limb, q: Array, target: Array, rotation: Array | None) -> tuple[Array, Array]:
    """Error (3,) or (6,) of the contact frame against a target, and its Jacobian, in metres."""
    if rotation is None:
        position, jacobian = limb.kinematics.position_and_jacobian(q)
        return target - position, jacobian
    position, turned, jacobian = limb.kinematics.placement_and_jacobian(q)
    error = np.empty(6)
    error[:3] = target - position
    error[3:] = ROTATION_LENGTH * pin.log3(rotation @ turned.T)
    jacobian[3:] *= ROTATION_LENGTH
    return error, jacobian


def _facing_task(limb: Limb, q: Array, normal: Array) -> tuple[Array, Array]:
    """Rotation vector (3,) from the contact frame's z axis to a normal, and Jacobian, metres."""
    _, rotation, jacobian = limb.kinematics.placement_and_jacobian(q)
    axis = rotation[:, 2]
    turn = np.array(
        [
            axis[1] * normal[2] - axis[2] * normal[1],
            axis[2] * normal[0] - axis[0] * normal[2],
            axis[0] * normal[1] - axis[1] * normal[0],
        ]
    )
    sine, cosine = float(np.sqrt(turn @ turn)), float(axis @ normal)
    if sine < 1e-9 and cosine < 0:  # half a turn, about any perpendicular axis: here the frame's x
        turn, sine = rotation[:, 0], 1.0
    scale = np.arctan2(sine, cosine) / max(sine, 1e-9)
    spin = jacobian[3:] - np.outer(axis, axis @ jacobian[3:])
    return ROTATION_LENGTH * scale * turn, ROTATION_LENGTH * spin
