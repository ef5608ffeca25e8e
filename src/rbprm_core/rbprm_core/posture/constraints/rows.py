"""Linearised constraints: rows of a quadratic program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.failures import Failure
from rbprm_core.posture.kinematics import Kinematics


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

    def failure(self, violation: float) -> Failure:
        """The failure of a problem in which this constraint stays violated.

        Args:
            violation: largest violation of its rows.
        """


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
