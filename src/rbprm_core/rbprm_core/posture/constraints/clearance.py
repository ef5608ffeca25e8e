r"""Distances between bodies, and between bodies and the environment, kept above a margin.

Escande et al. 2013, equations 5b, 5c and 19, linearised at the near features of each pair: with
the nearest points $p_1$, $p_2$ of a feature, its normal $n$ and its gap $d$,

$$d + n^T (J_{p_2} - J_{p_1})\, \delta q \geq d_{min}.$$
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.body_pairs import ENVIRONMENT, BodyPairs
from rbprm_core.posture.constraints.rows import ByRows, Rows
from rbprm_core.posture.kinematics import Kinematics
from rbprm_core.robot import Robot

STANDING_MARGIN = 3e-4
"""Metres that a limb in contact keeps from the environment, after it is lifted off its surface."""


class Clearance(ByRows):
    """No pair of bodies is nearer than a margin.

    Args:
        robot: the robot.
        pairs: pairs of bodies, with their features.
        contacts: contacts whose limbs touch the environment.
        margin: smallest distance, metres.
    """

    tolerance = 1e-4

    def __init__(
        self, robot: Robot, pairs: BodyPairs, contacts: Iterable[Contact], margin: float
    ) -> None:
        self._robot, self._pairs, self._margin = robot, pairs, margin
        self._normals = {contact.limb: contact.normal for contact in contacts}
        ends = {robot.limbs[limb].last_joint for limb in self._normals}
        margins = [STANDING_MARGIN if joint in ends else margin for joint in pairs.joints]
        self._margins = np.array(margins)
        self._worst = (ENVIRONMENT, ENVIRONMENT)

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`."""
        near = self._pairs.near(kinematics.data, self._normals)
        itself = near.second != ENVIRONMENT
        # Velocity of the gap: the wrench of a unit force along the normal, on both bodies.
        wrenches = np.hstack([near.normals, _cross(near.points, near.normals)])
        moving = (itself[:, None] & self._pairs.moving[near.second]).astype(float)
        moving -= self._pairs.moving[near.first]
        margins = np.where(itself, self._margin, self._margins[near.first])
        lower = margins - near.gaps
        if len(lower):
            worst = int(np.argmax(lower))
            self._worst = int(near.first[worst]), int(near.second[worst])
        matrix = (wrenches @ kinematics.jacobians) * moving
        return Rows(matrix, lower, np.full(len(lower), np.inf))

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        first, second = self._worst
        limb = self._limb(first) or self._limb(second)
        names = self._pairs.names
        if second != ENVIRONMENT:
            body = f"{names[first]} and {names[second]}"
            return Failure.of(Cause.SELF_COLLISION, limb, body=body)
        return Failure.of(Cause.BODY_COLLISION, limb, body=names[first])

    def _limb(self, body: int) -> str:
        """Name of the limb that a body belongs to, "" for the root part and the environment."""
        if body == ENVIRONMENT:
            return ""
        joint = self._robot.fixed_to(int(self._pairs.joints[body]))
        return next((limb.name for limb in self._robot.limbs if joint in limb.joints), "")


def _cross(first: Array, second: Array) -> Array:
    """Cross products (m, 3) of rows."""
    a, b = first[:, [1, 2, 0]], second[:, [2, 0, 1]]
    return np.asarray(a * b - first[:, [2, 0, 1]] * second[:, [1, 2, 0]])
