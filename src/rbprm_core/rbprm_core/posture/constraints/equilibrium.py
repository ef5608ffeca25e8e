r"""Static equilibrium on some contacts, by cutting planes on the centre of mass.

$b_0$ is a concave, piecewise linear function of the centre of mass $c$. With moments about the
present centre of mass $c_k$, the dual solution $\nu = (a, b)$ of Tonneau et al. 2018, equation (9),
stays feasible wherever the centre of mass goes, so that for all $c$

$$b_0(c) \leq b_0(c_k) + (F \times b) \cdot (c - c_k), \quad F = -m g.$$

Each linearisation adds one such row; rows of earlier steps stay valid and are kept.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.rows import Rows
from rbprm_core.posture.kinematics import Kinematics

MARGIN = 0.05
"""Newtons aimed at beyond the bound: without it the last step ends a rounding error short of it."""


class EquilibriumOnContacts:
    """b0 of a contact set reaches a bound.

    Args:
        stability: robustness of the robot's contact sets.
        contacts: the contacts that carry the robot.
        min_robustness: the bound, newtons.

    Attributes:
        robustness: b0 at the last linearisation, newtons.
    """

    tolerance = 1e-9

    def __init__(
        self, stability: Stability, contacts: Sequence[Contact], min_robustness: float
    ) -> None:
        self._stability, self._contacts = stability, tuple(contacts)
        self._min_robustness = min_robustness
        self._cuts: list[tuple[Array, float]] = []  # gradient g, offset o: b0(c) <= o + g . c
        self.robustness = -np.inf

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`; without any balancing forces, and in force closure, no rows."""
        com, jacobian = kinematics.com, kinematics.com_jacobian
        value, gradient = self._stability.b0_gradient(self._contacts, com)
        self.robustness = value
        if np.isfinite(value) and np.isfinite(gradient).all():
            self._cuts.append((gradient, value - float(gradient @ com)))
        if not self._cuts or value == np.inf:
            return Rows(np.zeros((0, jacobian.shape[1])), np.zeros(0), np.zeros(0))
        gradients = np.array([cut[0] for cut in self._cuts])
        values = np.array([cut[1] for cut in self._cuts]) + gradients @ com
        lower = self._min_robustness + MARGIN - values
        return Rows(gradients @ jacobian, lower, np.full(len(lower), np.inf))

    def violation(self, rows: Rows) -> float:
        """See `Constraint.violation`: newtons by which b0 misses the bound, without the margin."""
        return max(self._min_robustness - self.robustness, 0.0)

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        return Failure.of(
            Cause.LOW_ROBUSTNESS,
            robustness=self.robustness,
            threshold=self._min_robustness,
            contacts=len(self._contacts),
        )
