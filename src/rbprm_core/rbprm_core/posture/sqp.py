"""Sequential quadratic programming in the tangent space; knows nothing of robots.

Each step minimises the criterion's quadratic model under the linearised constraints and a trust
region. Where these contradict each other, as far from the contacts, the constraints are relaxed at
a price: the elastic step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.posture.quadratic_program import QuadraticProgram, solve

X = TypeVar("X")

ELASTIC_PRICE = 1e4
"""Weight of the squared relaxation of a row, against a weight of one of the criterion."""


@dataclass(frozen=True, eq=False)
class Linearisation:
    """A nonlinear program linearised at a point.

    Attributes:
        matrix: (m, k) Jacobian of the constraints.
        lower: (m,) lower bounds on matrix @ step.
        upper: (m,) upper bounds on matrix @ step.
        low: (k,) lower bounds of the step.
        high: (k,) upper bounds of the step.
        gradient: (k,) gradient of the criterion.
        hessian: (k, k) positive definite model of its second derivative.
        violation: largest violation of the constraints, in units of their tolerances.
    """

    matrix: Array
    lower: Array
    upper: Array
    low: Array
    high: Array
    gradient: Array
    hessian: Array
    violation: float


class NonlinearProgram(Protocol[X]):
    """Constraints and criterion on a point of some manifold."""

    def linearise(self, point: X) -> Linearisation:
        """The program linearised at a point.

        Args:
            point: the point.
        """

    def moved(self, point: X, step: Array) -> X:
        """The point after a step (k,).

        Args:
            point: the point.
            step: (k,) step.
        """

    def accepts(self, point: X) -> bool:
        """Final test of a point that satisfies the linearised constraints.

        A program may hold costly constraints back until they are violated: it then returns False,
        and `linearise` contains them from now on.

        Args:
            point: the point.
        """


@dataclass(frozen=True)
class SqpOptions:
    """Options of the solver.

    Attributes:
        max_steps: largest number of steps.
        criterion_steps: steps taken for the criterion's sake once the constraints are satisfied.
        min_step: length of a step below which the criterion counts as minimal.
        qp_solver: name of the solver of the quadratic programs.
    """

    max_steps: int = 12
    criterion_steps: int = 0
    min_step: float = 1e-4
    qp_solver: str = "daqp"


@dataclass(frozen=True, eq=False)
class SqpResult(Generic[X]):
    """Result of the solver.

    Attributes:
        point: the last point.
        solved: True where it satisfies all constraints.
        steps: number of steps.
    """

    point: X
    solved: bool
    steps: int


def minimise(program: NonlinearProgram[X], start: X, options: SqpOptions) -> SqpResult[X]:
    """A point that satisfies the constraints, near a minimum of the criterion.

    Args:
        program: the nonlinear program.
        start: point from which the search starts.
        options: options of the solver.
    """
    point, best, extra = start, None, options.criterion_steps
    restarted = False
    for steps in range(options.max_steps + 1):
        local = program.linearise(point)
        if local.violation <= 1.0:
            if program.accepts(point):
                best = point
                if extra == 0:
                    return SqpResult(point, True, steps)
                extra -= 1
            elif best is None and not restarted:
                # The new constraints are linearised best where they are satisfied.
                point, restarted = start, True
                local = program.linearise(point)
        if steps == options.max_steps:
            break
        step = _step(local, options.qp_solver)
        if step is None:
            break
        if best is not None and float(np.abs(step).max()) < options.min_step:
            break
        point = program.moved(point, step)
    return SqpResult(point if best is None else best, best is not None, steps)


def _step(local: Linearisation, solver: str) -> Array | None:
    """The step (k,) of the linearised program, relaxed where its rows contradict each other."""
    program = QuadraticProgram(
        local.hessian, local.gradient, local.matrix, local.lower, local.upper, local.low, local.high
    )
    step = solve(program, solver)
    return _elastic_step(local, solver) if step is None else step


def _elastic_step(local: Linearisation, solver: str) -> Array | None:
    """The step of a program whose rows may be broken at a quadratic price."""
    rows, size = local.matrix.shape
    hessian = np.zeros((size + rows, size + rows))
    hessian[:size, :size] = local.hessian
    hessian[size:, size:] = ELASTIC_PRICE * np.eye(rows)
    gradient = np.concatenate([local.gradient, np.zeros(rows)])
    free = np.full(rows, 1e6)
    relaxed = solve(
        QuadraticProgram(
            hessian,
            gradient,
            np.hstack([local.matrix, np.eye(rows)]),
            local.lower,
            local.upper,
            np.concatenate([local.low, -free]),
            np.concatenate([local.high, free]),
        ),
        solver,
    )
    return None if relaxed is None else relaxed[:size]
