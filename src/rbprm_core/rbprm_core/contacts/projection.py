"""Projection of a limb onto a contact: damped Newton steps on the limb's own joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from rbprm_core.robot.limb import Limb

Array = NDArray[np.float64]

TOLERANCE = 1e-5  # metres; a hundredth of what a plan is held to
ITERATIONS = 12
DAMPING = 1e-6  # square metres; keeps steps finite near singularities
STALLED = 0.7  # an error that shrinks less than this a step will not get there in time


def project(limb: Limb, start: Array, target: Array) -> Array | None:
    """Limb joints (n,) that put the contact centre on a target (3,) in the base frame.

    Levenberg-Marquardt with the joints kept inside their limits after each step.

    Args:
        start: (n,) joints to start from, near the target.

    Returns:
        Joints inside the limits, or None where the target is not reached.
    """
    q = start
    last = np.inf
    for i in range(ITERATIONS):
        position, jacobian = limb.kinematics.position_and_jacobian(q)
        error = target - position
        size = float(error @ error)
        if size < TOLERANCE * TOLERANCE:
            return q
        if i > 2 and size > STALLED * last:
            return None
        last = size
        gram = jacobian @ jacobian.T
        gram.flat[::4] += DAMPING
        _, step, _ = dposv(gram, error)
        q = np.minimum(np.maximum(q + jacobian.T @ step, limb.low), limb.high)
    return None
