"""Projection of a limb onto a contact: damped Newton steps on the limb's own joints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from rbprm_core.robot.limb import Limb

Array = NDArray[np.float64]

TOLERANCE = 1e-5  # metres; a hundredth of what a plan is held to
ITERATIONS = 12
DAMPING = 1e-6  # square metres; keeps steps finite near singularities
STALLED = 0.7  # an error that shrinks less than this a step will not get there in time
ARM = 0.2  # metres that one radian of a patch's rotation counts
STIFF = 0.1  # how readily a base moves beside the joints, metres a radian


def project(limb: Limb, start: Array, target: Array, rotation: Array | None = None) -> Array | None:
    """Limb joints (n,) that put the contact frame on a target in the base frame.

    Levenberg-Marquardt with the joints kept inside their limits after each step.

    Args:
        start: (n,) joints to start from, near the target.
        target: (3,) metres. rotation: (3, 3); None where only the position counts.

    Returns:
        Joints inside the limits, or None where the target is not reached.
    """
    return _solve(limb.low, limb.high, start, lambda q: _task(limb, q, target, rotation))


def project_with_base(
    limb: Limb, start: Array, target: Array, rotation: Array | None, most: float
) -> tuple[Array, Array] | None:
    """Limb joints (n,) and a shift (3,) of the limb's base that put the contact frame on a target.

    For limbs whose joints alone cannot keep a contact while the base moves: a knee stays on a
    sphere about its hip.

    Args:
        start: (n,) joints to start from. target: (3,), rotation: (3, 3) or None, as in `project`.
        most: largest shift, metres.

    Returns:
        Joints inside the limits and the shift in the base frame, metres; None where the target is
        not reached.
    """
    count = len(start)
    bound = np.full(3, most / STIFF)
    low, high = np.concatenate([limb.low, -bound]), np.concatenate([limb.high, bound])

    def task(x: Array) -> tuple[Array, Array]:
        error, jacobian = _task(limb, x[:count], target - STIFF * x[count:], rotation)
        return error, np.hstack([jacobian, STIFF * np.eye(len(error), 3)])

    found = _solve(low, high, np.concatenate([start, np.zeros(3)]), task)
    if found is None:
        return None
    shift = STIFF * found[count:]
    return (found[:count], shift) if np.linalg.norm(shift) <= most else None


def touch(limb: Limb, start: Array, normal: Array, offset: float) -> Array | None:
    """Limb joints (n,) that put the contact centre on a plane, wherever on it.

    Args:
        start: (n,) joints to start from. normal: (3,) unit, of the plane n . x = offset in the base
            frame, metres.

    Returns:
        Joints inside the limits, or None where the plane is not reached.
    """

    def task(q: Array) -> tuple[Array, Array]:
        position, jacobian = limb.kinematics.position_and_jacobian(q)
        return np.array([offset - normal @ position]), normal[None] @ jacobian

    return _solve(limb.low, limb.high, start, task)


def face(limb: Limb, start: Array, normal: Array) -> Array | None:
    """Limb joints (n,) whose patch faces a surface, wherever that puts the patch.

    Args:
        start: (n,) joints to start from. normal: (3,) unit, of the surface in the base frame.

    Returns:
        Joints inside the limits, or None where the patch cannot be turned so far.
    """
    return _solve(limb.low, limb.high, start, lambda q: _facing_task(limb, q, normal))


def _solve(
    low: Array, high: Array, start: Array, task: Callable[[Array], tuple[Array, Array]]
) -> Array | None:
    """Joints (n,) at which a task's error vanishes, by damped Newton steps inside the limits."""
    q = start
    last = np.inf
    for i in range(ITERATIONS):
        error, jacobian = task(q)
        size = float(error @ error)
        if size < TOLERANCE * TOLERANCE:
            return q
        if i > 2 and size > STALLED * last:
            return None
        last = size
        gram = jacobian @ jacobian.T
        gram.flat[:: len(error) + 1] += DAMPING
        _, step, _ = dposv(gram, error)
        q = np.minimum(np.maximum(q + jacobian.T @ step, low), high)
    return None


def _task(limb: Limb, q: Array, target: Array, rotation: Array | None) -> tuple[Array, Array]:
    """What is missing (3,) or (6,) and its Jacobian, in metres."""
    if rotation is None:
        position, jacobian = limb.kinematics.position_and_jacobian(q)
        return target - position, jacobian
    position, turned, jacobian = limb.kinematics.placement_and_jacobian(q)
    error = np.empty(6)
    error[:3] = target - position
    error[3:] = ARM * pin.log3(rotation @ turned.T)
    jacobian[3:] *= ARM
    return error, jacobian


def _facing_task(limb: Limb, q: Array, normal: Array) -> tuple[Array, Array]:
    """The rotation (3,) that turns the patch's normal onto another, and its Jacobian, metres."""
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
    if sine < 1e-9 and cosine < 0:  # half a turn: about any axis across, here the patch's first
        turn, sine = rotation[:, 0], 1.0
    scale = np.arctan2(sine, cosine) / max(sine, 1e-9)
    return ARM * scale * turn, ARM * (jacobian[3:] - np.outer(axis, axis @ jacobian[3:]))
