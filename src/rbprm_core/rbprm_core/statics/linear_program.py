r"""The linear program behind robustness, solved by its dual with DAQP.

Primal, equation (8) of Tonneau et al. 2018: $\max b$ subject to $A \beta = t$ and
$\beta \geq b \mathbf{1}$.

Dual, equation (9): $\min t^T \nu$ subject to $A^T \nu \geq 0$ and $\mathbf{1}^T A^T \nu = 1$.

The dual has as many variables as $A$ has rows, at most 7, whatever the number of contacts.
"""

from __future__ import annotations

import daqp
import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.errors import RbprmError

EQUALITY = 5  # sense of an equality constraint in DAQP
OPTIMAL, INFEASIBLE, UNBOUNDED = 1, -1, -3  # exit flags of DAQP
BALANCED = 1e-9  # residuals of the balance below this share of the target are rounding


def max_min_dual(matrix: Array, target: Array) -> tuple[float, Array]:
    r"""Return the optimum of `max_min_coefficient` and the dual solution $\nu$.

    The dual solution is feasible for every target, so that $t'^T \nu$ bounds the optimum of
    another target $t'$ from above.

    Args:
        matrix: (r, n) matrix $A$.
        target: (r,) vector $t$, of the order of magnitude of the entries of $A$.

    Returns:
        The optimum, and $\nu$ (r,), NaN where the optimum is not finite.

    Raises:
        RbprmError: the solver gave no answer.
    """
    flag, optimum, solution = _solve_dual(matrix, target)
    if flag == OPTIMAL and optimum > -1 / BALANCED:
        return optimum, solution
    return max_min_coefficient(matrix, target), np.full(len(target), np.nan)


def max_min_coefficient(matrix: Array, target: Array) -> float:
    r"""Return the largest $b$ for which some $\beta \geq b \mathbf{1}$ solves $A \beta = t$.

    Args:
        matrix: (r, n) matrix $A$.
        target: (r,) vector $t$, of the order of magnitude of the entries of $A$.

    Returns:
        The optimum, in the unit of the target; minus infinity where no $\beta$ of any sign solves
        $A \beta = t$; infinity where $b$ grows without bound.

    Raises:
        RbprmError: the solver gave no answer.
    """
    flag, optimum, _ = _solve_dual(matrix, target)
    if flag not in (OPTIMAL, INFEASIBLE, UNBOUNDED):
        # Dependent rows, as those of contacts on one line, can make the solver cycle.
        matrix, target = _independent_rows(matrix, target)
        if not np.isfinite(target).all():
            return -np.inf
        flag, optimum, _ = _solve_dual(matrix, target)
    if flag == OPTIMAL:
        # An optimum this low means a contradiction that rounding has hidden.
        return optimum if optimum > -1 / BALANCED else -np.inf
    if flag == UNBOUNDED:
        return -np.inf
    if flag == INFEASIBLE:  # the primal is then unbounded, or infeasible as well
        return np.inf if _is_solvable(matrix, target) else -np.inf
    raise RbprmError(f"the equilibrium problem was not solved: DAQP ended with flag {flag}")


def _solve_dual(matrix: Array, target: Array) -> tuple[int, float, Array]:
    """Return the exit flag of DAQP, the optimum of the dual, and its solution (r,)."""
    rows, count = matrix.shape
    constraints = np.empty((count + 1, rows))
    constraints[:count] = matrix.T
    constraints[count] = matrix.sum(axis=1)
    upper, lower = np.full(count + 1, np.inf), np.zeros(count + 1)
    upper[count] = lower[count] = 1.0
    sense = np.zeros(count + 1, dtype=np.int32)
    sense[count] = EQUALITY
    # Without eliminating the equality first, DAQP wrongly calls 3 % of the problems with three
    # contacts unbounded.
    solution, optimum, flag, _ = daqp.solve(
        None, target, constraints, upper, lower, sense, eq_reduction=1
    )
    return int(flag), float(optimum), solution


def _independent_rows(matrix: Array, target: Array) -> tuple[Array, Array]:
    """Return the same equations in independent rows; the target is NaN where they contradict."""
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    kept = sizes > BALANCED * sizes[0]
    reduced = left.T @ target
    rest = target - left[:, kept] @ reduced[kept]
    if np.abs(rest).max() > BALANCED:
        reduced = np.full_like(reduced, np.nan)
    return right[kept], reduced[kept] / sizes[kept]


def _is_solvable(matrix: Array, target: Array) -> bool:
    r"""Return whether some $\beta$, of either sign, solves $A \beta = t$."""
    found, *_ = np.linalg.lstsq(matrix, target, rcond=None)
    return bool(np.abs(matrix @ found - target).max() < BALANCED)
