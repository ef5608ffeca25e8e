r"""Torque limits: the torque ratio of the supporting contacts stays below a bound.

The ratio is the optimum of a linear program (`rbprm_core.body.torques`). With its multipliers
$\mu$ of the balance and $\lambda$ of the torque rows, the envelope theorem gives

$$\frac{dr}{dq} = (\mu, \lambda)^T \frac{\partial (h - J^T f)}{\partial q}$$

at constant forces: the derivative of the static torques, which pinocchio computes analytically.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.torques import TorqueModel
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.rows import Rows
from rbprm_core.posture.kinematics import Kinematics

CUTS = 4
"""Number of linearisations that are kept: with the last one alone, two joints take turns."""
AIM = 0.005
"""Share aimed at below the bound, against rounding of the last step."""


class TorqueRatio:
    """The torque ratio on some contacts is at most a bound.

    Args:
        torques: static torques of the robot.
        contacts: the contacts that carry the robot.
        max_ratio: largest share of a joint's effort limit.
    """

    tolerance = 1e-9

    def __init__(self, torques: TorqueModel, contacts: Sequence[Contact], max_ratio: float) -> None:
        self._torques, self._contacts, self._max_ratio = torques, tuple(contacts), max_ratio
        self._joint, self._ratio = "", np.inf
        self._cuts: list[tuple[Array, float, Array]] = []  # configuration, ratio, gradient

    def holds(self, q: Array) -> bool:
        """True where a configuration satisfies the constraint.

        Args:
            q: (nq,) configuration.
        """
        balance = self._torques.balance(q, self._contacts)
        self._joint, self._ratio = balance.joint, balance.ratio
        return balance.ratio <= self._max_ratio

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`; no row where no forces balance the robot."""
        q = kinematics.q
        balance, gradient = self._torques.balance_gradient(q, self._contacts)
        self._joint, self._ratio = balance.joint, balance.ratio
        if not np.isfinite(balance.ratio):
            return Rows(np.zeros((0, len(gradient))), np.zeros(0), np.zeros(0))
        self._cuts = [*self._cuts[1 - CUTS :], (q, balance.ratio, gradient)]
        model = kinematics.robot.model
        values = [r + float(g @ pin.difference(model, point, q)) for point, r, g in self._cuts]
        upper = self._max_ratio - AIM - np.array(values)
        return Rows(np.array([g for _, _, g in self._cuts]), np.full(len(upper), -np.inf), upper)

    def violation(self, rows: Rows) -> float:
        """See `Constraint.violation`, without the margin aimed at."""
        return max(self._ratio - self._max_ratio, 0.0)

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        return Failure.of(
            Cause.TORQUE_LIMIT, body=self._joint, ratio=self._ratio, limit=self._max_ratio
        )
