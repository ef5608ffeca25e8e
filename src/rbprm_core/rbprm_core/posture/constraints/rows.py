"""Linearised constraints: rows of a quadratic program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.failures import Failure
from rbprm_core.posture.kinematics import Kinematics

MIN_NORM = 1e-9
"""Norm of a row below which it does not depend on the step."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Bounds on a linear function of the step: lower <= matrix @ step <= upper.

    The step is in the tangent space of the configuration; an equality has equal bounds.

    Attributes:
        matrix: (m, nv) Jacobian.
        lower: (m,) lower bounds, minus infinity for none.
        upper: (m,) upper bounds, infinity for none.
    """

    matrix: Array
    lower: Array
    upper: Array

    @property
    def violation(self) -> float:
        """Largest amount by which a zero step breaks a bound; 0 where it breaks none."""
        return float(max(self.lower.max(initial=0.0), -self.upper.min(initial=0.0), 0.0))

    @property
    def distance(self) -> float:
        """Largest length of a step that mends a single broken bound; infinity without rows."""
        if not len(self.lower):
            return np.inf
        broken = np.maximum(self.lower, -self.upper)
        norms = np.sqrt(np.einsum("ij,ij->i", self.matrix, self.matrix))
        return float((broken / np.maximum(norms, MIN_NORM)).max(initial=0.0))


class Constraint(Protocol):
    """A constraint on the configuration that is linearised at each step of the solver.

    Attributes:
        tolerance: violation up to which it counts as satisfied, in its own unit.
    """

    tolerance: float

    def rows(self, kinematics: Kinematics) -> Rows:
        """The constraint linearised at a configuration.

        Args:
            kinematics: the robot at the configuration.
        """

    def violation(self, rows: Rows) -> float:
        """Amount by which the constraint is violated, in its own unit.

        Args:
            rows: the constraint's rows at the configuration.
        """

    def failure(self, violation: float) -> Failure:
        """The failure of a problem in which this constraint stays violated.

        Args:
            violation: amount by which it is violated, in its own unit.
        """


class ByRows:
    """A constraint whose violation is that of its rows."""

    def violation(self, rows: Rows) -> float:
        """See `Constraint.violation`."""
        return rows.violation


def stacked(rows: Sequence[Rows], size: int) -> Rows:
    """Several rows as one.

    Args:
        rows: the rows.
        size: dimension nv of the step.
    """
    if not rows:
        return Rows(np.zeros((0, size)), np.zeros(0), np.zeros(0))
    return Rows(
        np.concatenate([row.matrix for row in rows]),
        np.concatenate([row.lower for row in rows]),
        np.concatenate([row.upper for row in rows]),
    )
