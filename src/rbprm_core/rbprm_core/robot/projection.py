"""Projection of a limb onto a contact: damped Newton steps on the limb's own joints."""

from __future__ import annotations

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


def project(limb: Limb, start: Array, target: Array, rotation: Array | None = None) -> Array | None:
    """Limb joints (n,) that put the contact frame on a target in the base frame.

    Levenberg-Marquardt with the joints kept inside their limits after each step.

    Args:
        start: (n,) joints to start from, near the target.
        target: (3,) metres. rotation: (3, 3); None where only the position counts.

    Returns:
        Joints inside the limits, or None where the target is not reached.
    """
    q = start
    last = np.inf
    for i in range(ITERATIONS):
        error, jacobian = _task(limb, q, target, rotation)
        size = float(error @ error)
        if size < TOLERANCE * TOLERANCE:
            return q
        if i > 2 and size > STALLED * last:
            return None
        last = size
        gram = jacobian @ jacobian.T
        gram.flat[:: len(error) + 1] += DAMPING
        _, step, _ = dposv(gram, error)
        q = np.minimum(np.maximum(q + jacobian.T @ step, limb.low), limb.high)
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
