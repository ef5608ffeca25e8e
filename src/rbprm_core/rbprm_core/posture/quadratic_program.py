r"""Convex quadratic programs by the name of the solver, through qpsolvers.

$\min \tfrac12 x^T H x + g^T x$ subject to $l \leq A x \leq u$ and $x_l \leq x \leq x_u$.

DAQP is called directly: through qpsolvers the posture generator's programs take twice as long,
since their two-sided rows have to be split there (figures in docs/posture.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import daqp
import numpy as np
import qpsolvers
import scipy.sparse

from rbprm_core.arrays import Array
from rbprm_core.validation import one_of

SOLVERS = ("daqp", "osqp", "proxqp")
EQUALITY = 5  # sense of an equality constraint in DAQP
SOFT = 8  # sense of a constraint that may be broken
OPTIMAL, SOFT_OPTIMAL = 1, 2  # exit flags of DAQP


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """A quadratic program with two-sided rows.

    Attributes:
        hessian: (n, n) matrix H, positive definite.
        gradient: (n,) vector g.
        matrix: (m, n) matrix A.
        lower: (m,) lower bounds of the rows, minus infinity for none.
        upper: (m,) upper bounds of the rows, infinity for none; equal bounds make an equality.
        low: (n,) lower bounds of the variables.
        high: (n,) upper bounds of the variables.
    """

    hessian: Array
    gradient: Array
    matrix: Array
    lower: Array
    upper: Array
    low: Array
    high: Array


def solve(program: QuadraticProgram, solver: str = "daqp") -> Array | None:
    """The solution (n,) of a quadratic program, None where the solver finds none.

    Args:
        program: the program.
        solver: "daqp", "osqp" or "proxqp".

    Raises:
        InvalidInput: an unknown solver.
    """
    one_of("qp_solver", solver, SOLVERS)
    return _by_daqp(program, 0) if solver == "daqp" else _by_qpsolvers(program, solver)


def solve_relaxed(program: QuadraticProgram, price: float, solver: str = "daqp") -> Array | None:
    r"""The solution (n,) of a program whose rows may be broken at a price.

    The cost has the additional term $\tfrac p2 \sum_i s_i^2$ of the amounts $s_i$ by which the rows
    are broken, each measured along its row: the violation over the norm of the row. The norm is
    $\sqrt{a_i^T H^{-1} a_i}$.

    Args:
        program: the program; the bounds of its variables are kept.
        price: the weight p.
        solver: "daqp", "osqp" or "proxqp".

    Raises:
        InvalidInput: an unknown solver.
    """
    one_of("qp_solver", solver, SOLVERS)
    if solver == "daqp":
        return _by_daqp(program, SOFT, rho_soft=1.0 / price)
    rows, size = program.matrix.shape
    metric = np.linalg.solve(program.hessian, program.matrix.T).T
    norms = np.sqrt(np.einsum("ij,ij->i", program.matrix, metric))
    hessian = np.zeros((size + rows, size + rows))
    hessian[:size, :size] = program.hessian
    hessian[size:, size:] = price * np.eye(rows)
    free = np.full(rows, np.inf)
    relaxed = QuadraticProgram(
        hessian,
        np.concatenate([program.gradient, np.zeros(rows)]),
        np.hstack([program.matrix, np.diag(norms)]),
        program.lower,
        program.upper,
        np.concatenate([program.low, -free]),
        np.concatenate([program.high, free]),
    )
    solution = _by_qpsolvers(relaxed, solver)
    return None if solution is None else solution[:size]


def _by_daqp(program: QuadraticProgram, kind: int, **settings: float) -> Array | None:
    """The solution by DAQP, its rows of a kind: 0 or `SOFT`."""
    count = len(program.gradient)
    lower = np.concatenate([program.low, program.lower])
    upper = np.concatenate([program.high, program.upper])
    sense = np.zeros(len(lower), dtype=np.int32)
    sense[count:] = kind
    sense[count:][program.lower == program.upper] += EQUALITY
    matrix = np.ascontiguousarray(program.matrix)
    solution, _, flag, _ = daqp.solve(
        program.hessian, program.gradient, matrix, upper, lower, sense, **settings
    )
    return np.asarray(solution) if flag in (OPTIMAL, SOFT_OPTIMAL) else None


def _by_qpsolvers(program: QuadraticProgram, solver: str) -> Array | None:
    equal = program.lower == program.upper
    above, below = ~equal & np.isfinite(program.upper), ~equal & np.isfinite(program.lower)
    inequalities = np.vstack([program.matrix[above], -program.matrix[below]])
    bounds = np.concatenate([program.upper[above], -program.lower[below]])
    sparse = solver == "osqp"
    wrap = scipy.sparse.csc_matrix if sparse else np.asarray
    accuracy: dict[str, Any] = {"eps_abs": 1e-9} | ({"eps_rel": 1e-9} if sparse else {})
    return qpsolvers.solve_qp(
        wrap(program.hessian),
        program.gradient,
        wrap(inequalities) if len(bounds) else None,
        bounds if len(bounds) else None,
        wrap(program.matrix[equal]) if equal.any() else None,
        program.upper[equal] if equal.any() else None,
        program.low,
        program.high,
        solver=solver,
        **accuracy,
    )
