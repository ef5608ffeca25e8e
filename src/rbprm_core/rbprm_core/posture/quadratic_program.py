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
OPTIMAL = 1  # exit flag of DAQP


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
    return _by_daqp(program) if solver == "daqp" else _by_qpsolvers(program, solver)


def _by_daqp(program: QuadraticProgram) -> Array | None:
    count = len(program.gradient)
    lower = np.concatenate([program.low, program.lower])
    upper = np.concatenate([program.high, program.upper])
    sense = np.zeros(len(lower), dtype=np.int32)
    sense[count:][program.lower == program.upper] = EQUALITY
    matrix = np.ascontiguousarray(program.matrix)
    solution, _, flag, _ = daqp.solve(
        program.hessian, program.gradient, matrix, upper, lower, sense
    )
    return np.asarray(solution) if flag == OPTIMAL else None


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
