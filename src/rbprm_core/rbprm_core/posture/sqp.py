"""Sequential quadratic programming in the tangent space; knows nothing of robots.

From a point that violates constraints, a step is the shortest one to the linearised constraints, in
the criterion's metric and inside a trust region: the criterion's pull would only slow it down. From
a point that satisfies them, a step minimises the criterion's quadratic model under the constraints.
The constraints may contradict each other, as far from the contacts: each of them may be broken at a
price, so high that this happens only where it must.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.posture.quadratic_program import QuadraticProgram, solve_relaxed

X = TypeVar("X")

PRICE = 1e8
"""Weight of the square of the amount by which a row is broken, against 1 of the criterion's."""
MIN_NORM = 1e-9
"""Norm of a row below which it does not depend on the step."""


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
        max_steps: largest number of steps until the constraints are satisfied.
        criterion_steps: largest number of steps after that, for the criterion's sake.
        min_step: length of a step below which the criterion counts as minimal.
        max_step: largest change of a coordinate in one step.
        patience: number of steps after which the distance to the constraints must have shrunk.
        min_progress: share of its value to which the distance must have shrunk by then.
        qp_solver: name of the solver of the quadratic programs.
    """

    max_steps: int = 16
    criterion_steps: int = 0
    min_step: float = 1e-4
    max_step: float = 0.3
    patience: int = 4
    min_progress: float = 0.5
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
    point, best, left = start, None, options.criterion_steps
    region, restarted = TrustRegion(options), False
    for steps in range(options.max_steps + options.criterion_steps + 1):
        local = program.linearise(point)
        feasible = local.violation <= 1.0 and program.accepts(point)
        if feasible:
            best = point
        elif local.violation <= 1.0 and best is None and not restarted:
            # The new constraints are linearised best where they are satisfied.
            point, region, restarted = start, TrustRegion(options), True
            local = program.linearise(point)
        region.update(_distance(local))
        left -= best is not None
        if left < 0 or (best is None and (steps >= options.max_steps or region.stalls)):
            break
        step = _step(local, region.radius, feasible, options)
        if step is None or (feasible and np.abs(step).max() < options.min_step):
            break
        point = program.moved(point, step)
    return SqpResult(point if best is None else best, best is not None, steps)


class TrustRegion:
    """Bounds on a step, from the distances to the constraints so far.

    Args:
        options: options of the solver.

    Attributes:
        radius: largest change of a coordinate in the next step.
    """

    def __init__(self, options: SqpOptions) -> None:
        self._options, self.radius = options, options.max_step
        self._distances: list[float] = []

    def update(self, distance: float) -> None:
        """Take the distance of a new point into account.

        Args:
            distance: distance from the constraints.
        """
        if self._distances:
            grows = distance > self._distances[-1]
            self.radius = self.radius / 2 if grows else min(2 * self.radius, self._options.max_step)
        self._distances.append(distance)

    @property
    def stalls(self) -> bool:
        """True where the last steps have not come nearer to the constraints."""
        recent = self._options.patience
        if len(self._distances) <= recent:
            return False
        before = min(self._distances[:-recent])
        return min(self._distances[-recent:]) >= self._options.min_progress * before


def _distance(local: Linearisation) -> float:
    """Largest length of a step that mends a single broken row."""
    broken = np.maximum(local.lower, -local.upper)
    norms = np.sqrt(np.einsum("ij,ij->i", local.matrix, local.matrix))
    return float((broken / np.maximum(norms, MIN_NORM)).max(initial=0.0))


def _step(local: Linearisation, radius: float, pulled: bool, options: SqpOptions) -> Array | None:
    """The step (k,) of the linearised program, its rows broken where they contradict each other.

    Args:
        local: the linearised program.
        radius: largest change of a coordinate.
        pulled: False for the shortest step to the constraints, without the criterion's gradient.
        options: options of the solver.
    """
    program = QuadraticProgram(
        local.hessian,
        local.gradient if pulled else np.zeros(len(local.gradient)),
        local.matrix,
        local.lower,
        local.upper,
        np.maximum(local.low, -radius),
        np.minimum(local.high, radius),
    )
    return solve_relaxed(program, PRICE, options.qp_solver)
