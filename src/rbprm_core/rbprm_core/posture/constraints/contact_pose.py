"""A contact at a fixed place (Escande et al. 2013, equations 7 to 13)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.rows import ByRows, Rows
from rbprm_core.posture.kinematics import Kinematics, cross
from rbprm_core.robot import Robot


class ContactPose(ByRows):
    """The contact frame of a limb coincides with its contact.

    A ball has its centre one radius above the contact point, and for a part of a ball the cosine
    between its axis and the surface's normal is bounded; a patch has the whole pose of the contact.

    Args:
        robot: the robot.
        contact: the contact.
    """

    tolerance = 1e-5
    """Metres; an error of a radian counts as a metre."""

    def __init__(self, robot: Robot, contact: Contact) -> None:
        limb = robot.limbs[contact.limb]
        self._limb, self._spot, self._contact = limb, limb.spots[contact.spot], contact
        self._center = self._spot.center(contact.position, contact.rotation)

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`."""
        frame, jacobian = kinematics.spot(self._spot)
        error = self._center - frame.translation
        if self._spot.planar:
            turn = frame.rotation @ pin.log3(frame.rotation.T @ self._contact.rotation)
            target = np.concatenate([error, turn])
            return Rows(jacobian, target, target)
        if self._spot.min_cosine <= -1.0:
            return Rows(jacobian[:3], error, error)
        return self._part_of_ball(frame, jacobian, error)

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        return Failure.of(Cause.CONTACT_NOT_REACHED, self._limb.name, distance=violation)

    def _part_of_ball(self, frame: pin.SE3, jacobian: Array, error: Array) -> Rows:
        """The rows of a part of a ball: n . z is at least the smallest cosine."""
        axis, normal = frame.rotation[:, 2], self._contact.normal
        gradient = cross(axis, normal) @ jacobian[3:]
        missing = self._spot.min_cosine - float(axis @ normal)
        return Rows(
            np.vstack([jacobian[:3], gradient]),
            np.append(error, missing),
            np.append(error, np.inf),
        )
