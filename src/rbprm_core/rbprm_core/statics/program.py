"""The robust linear programme (8), solved by its dual (9)."""

from __future__ import annotations

import daqp
import numpy as np
from numpy.typing import NDArray

from rbprm_core.errors import RbprmError

Array = NDArray[np.float64]

EQUALITY = 5  # DAQP's mark of an equality constraint
OPTIMAL, INFEASIBLE, UNBOUNDED = 1, -1, -3  # DAQP's exit flags
BALANCED = 1e-9  # of the target; a residual of the balance below this is rounding


def largest_least(matrix: Array, target: Array) -> float:
    """The largest b such that A beta = t with every beta_k >= b.

    By its dual: minimise t . nu subject to A^T nu >= 0 and 1^T A^T nu = 1, whose optimum is the
    same.

    Args:
        matrix: A (r, n). target: t (r,), of the order of A's entries.

    Returns:
        Minus infinity where no beta, of whatever sign, solves A beta = t; infinity where b grows
        without bound.
    """
    flag, optimum = _solve_dual(matrix, target)
    if flag not in (OPTIMAL, INFEASIBLE, UNBOUNDED):
        # Rows that depend on each other, as of contacts on one line, can make the solver cycle.
        matrix, target = _independent(matrix, target)
        if not np.isfinite(target).all():
            return -np.inf
        flag, optimum = _solve_dual(matrix, target)
    if flag == OPTIMAL:
        return optimum if optimum > -1 / BALANCED else -np.inf  # a contradiction but for rounding
    if flag == UNBOUNDED:
        return -np.inf
    if flag == INFEASIBLE:  # of the dual: (8) is unbounded, unless it is infeasible itself
        return np.inf if _solvable(matrix, target) else -np.inf
    raise RbprmError(f"the statics problem was not solved: DAQP ended with flag {flag}")


def _solve_dual(matrix: Array, target: Array) -> tuple[int, float]:
    """DAQP's flag and the optimum of the dual."""
    rows, count = matrix.shape
    constraints = np.empty((count + 1, rows))
    constraints[:count] = matrix.T
    constraints[count] = matrix.sum(axis=1)
    upper, lower = np.full(count + 1, np.inf), np.zeros(count + 1)
    upper[count] = lower[count] = 1.0
    sense = np.zeros(count + 1, dtype=np.int32)
    sense[count] = EQUALITY
    # Eliminating the equality first matters: without it DAQP calls 3 % of three-contact problems
    # unbounded that are not.
    _, optimum, flag, _ = daqp.solve(None, target, constraints, upper, lower, sense, eq_reduction=1)
    return int(flag), float(optimum)


def _independent(matrix: Array, target: Array) -> tuple[Array, Array]:
    """The same equations in independent rows; a target of NaN where they contradict each other."""
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    kept = sizes > BALANCED * sizes[0]
    reduced = left.T @ target
    rest = target - left[:, kept] @ reduced[kept]
    if np.abs(rest).max() > BALANCED:
        reduced = np.full_like(reduced, np.nan)
    return right[kept], reduced[kept] / sizes[kept]


def _solvable(matrix: Array, target: Array) -> bool:
    """True where some beta, of either sign, solves A beta = t."""
    found, *_ = np.linalg.lstsq(matrix, target, rcond=None)
    return bool(np.abs(matrix @ found - target).max() < BALANCED)
