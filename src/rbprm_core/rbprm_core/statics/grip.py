"""Robustness without weight: how firmly contacts can be squeezed against each other.

Without weight (8) is homogeneous: no force at all balances, and if strictly positive coefficients
do, so do all their multiples. Its optimum is 0 or infinite, so it ranks nothing. What it lacks is
the size of the forces. With the coefficients adding up to a grip force F,

    b0 = max b  subject to  G beta = 0, 1^T beta = F, beta >= b,

the optimum is bounded by F over the number of generators. It is F times the min-weight metric of
grasping (Li, Culbertson, Burdick and Ames, "FRoGGeR", IROS 2023), whose forces are normalised as
in the grasp quality of Ferrari and Canny (ICRA 1992). Unlike the latter it depends neither on the
unit of length nor on the point that moments are taken about.

Positive b0 says that forces inside every cone balance, but not that they resist a moment about a
line that all contacts lie on. Contacts are in force closure where b0 is positive and G has rank 6:
then the generators span all wrenches positively.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.statics.equilibrium import contact_wrenches
from rbprm_core.statics.program import largest_least

Array = NDArray[np.float64]

GRIP_FORCE = 10.0
"""Newtons, where a request does not say: three finger-tips that press with 3 N each."""

ROUNDING = 1e-7  # of the largest singular value of G
MIN_SPREAD = 1e-2
"""Least over largest singular value of G, in units of the contacts' extent, to count as rank 6.

Points that lie on a line but for a hundredth of their extent resist no moment worth the name.
"""


def grip_robustness(points: Array, generators: Array, grip_force: float) -> float:
    """b0 in newtons of contacts without weight, as the module's text defines it.

    Args:
        points: (e, 3) metres. generators: (e, 4, 3) unit rays of their cones.
        grip_force: F, the sum of all coefficients, newtons.

    Returns:
        Positive in force closure, at most F / 4e. 0 where forces balance but a moment about a line
        is not resisted. Negative, or minus infinity, where the contacts only push to one side.
    """
    if len(points) == 0:
        return -np.inf
    arms = points - points.mean(axis=0)
    extent = float(np.sqrt((arms * arms).sum(axis=1).max()))
    if extent == 0.0:  # all in one point: no moments, and nothing to measure them by
        extent = 1.0
    matrix = contact_wrenches(arms / extent, generators)
    _, spread, balances = np.linalg.svd(matrix, full_matrices=False)
    # The balance G beta = 0 in as many orthonormal rows as it has independent ones, and what the
    # sum of the coefficients adds to them: all well scaled, however the contacts lie.
    balances = balances[spread > ROUNDING * spread[0]]
    total = np.ones(matrix.shape[1])
    total -= balances.T @ (balances @ total)
    size = float(np.linalg.norm(total))
    if size < ROUNDING:
        return -np.inf  # coefficients that balance add up to nothing: some pull
    target = np.append(np.zeros(len(balances)), 1.0 / size)
    b0 = grip_force * largest_least(np.vstack([balances, total / size]), target)
    closed = len(spread) == 6 and spread[-1] >= MIN_SPREAD * spread[0]
    return b0 if closed else min(b0, 0.0)
