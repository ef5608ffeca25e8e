r"""Robustness without weight: how firmly the contacts can be squeezed against each other.

Without weight, equation (8) of Tonneau et al. 2018 is homogeneous: zero force balances, and every
multiple of balancing coefficients balances too. Its optimum is 0 or infinite and ranks nothing.
Fixing the sum of the coefficients to a grip force $F$ bounds the size of the forces:

$b_0 = \max_{b, \beta} b$ subject to $G \beta = 0$, $\mathbf{1}^T \beta = F$ and
$\beta \geq b \mathbf{1}$

The optimum is at most $F$ divided by the number of generators. It is $F$ times the min-weight
metric of grasping (Li et al. 2023), whose forces are normalised as in the grasp quality of Ferrari
and Canny 1992. Unlike the latter it depends neither on the unit of length nor on the point about
which moments are taken.

Where $b_0 > 0$, forces strictly inside every cone balance. They may still not resist a moment about
a line through all contacts. The contacts are in force closure where $b_0 > 0$ and $G$ has rank 6:
then non-negative combinations of the generators span all wrenches.
"""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.statics.equilibrium import contact_wrenches
from rbprm_core.statics.linear_program import max_min_coefficient

GRIP_FORCE = 10.0
"""Default grip force in newtons: three finger-tips that press with 3 N each."""

ROUNDING = 1e-7
"""Singular values below this share of the largest one of $G$ are rounding."""

MIN_SPREAD = 1e-2
"""Smallest over largest singular value of $G$ from which on it counts as of rank 6.

$G$ is taken with moments in units of the contacts' extent.
Points off a line by less than a hundredth of their extent resist hardly any moment about it.
"""


def grip_robustness(points: Array, generators: Array, grip_force: float) -> float:
    """Return the robustness $b_0$ in newtons of contacts without weight (see the module).

    Args:
        points: (e, 3) contact points, metres, in any frame.
        generators: (e, 4, 3) unit generators of the friction cone at each point, same frame.
        grip_force: sum $F$ of all coefficients, newtons.

    Returns:
        Positive, at most $F / 4e$, in force closure; 0 where forces balance but a moment about a
        line is not resisted; negative or minus infinity where the contacts only push to one side.
    """
    if len(points) == 0:
        return -np.inf
    arms = points - points.mean(axis=0)
    extent = float(np.sqrt((arms * arms).sum(axis=1).max()))
    if extent == 0.0:  # all in one point: no moments, so any unit of length will do
        extent = 1.0
    matrix = contact_wrenches(arms / extent, generators)
    _, spread, balances = np.linalg.svd(matrix, full_matrices=False)
    # G beta = 0 as independent orthonormal rows, and the part of the sum of the coefficients that
    # is orthogonal to them: all well scaled, however the contacts lie.
    balances = balances[spread > ROUNDING * spread[0]]
    total = np.ones(matrix.shape[1])
    total -= balances.T @ (balances @ total)
    size = float(np.linalg.norm(total))
    if size < ROUNDING:
        return -np.inf  # balancing coefficients always add up to 0: some of them pull
    target = np.append(np.zeros(len(balances)), 1.0 / size)
    b0 = grip_force * max_min_coefficient(np.vstack([balances, total / size]), target)
    closed = len(spread) == 6 and spread[-1] >= MIN_SPREAD * spread[0]
    return b0 if closed else min(b0, 0.0)
