"""A placement in SE(3): position and unit quaternion, in the order of ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pinocchio as pin
from numpy.typing import ArrayLike

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.validation import coordinates, finite_array

UNIT_TOLERANCE = 1e-3  # on the norm: quaternions of messages may be normalised in single precision


@dataclass(frozen=True, eq=False)
class Placement:
    """A placement of one frame in another.

    Attributes:
        position: (3,) position, metres.
        orientation: (4,) unit quaternion [x, y, z, w].
    """

    position: Array
    orientation: Array

    @staticmethod
    def parse(
        position: ArrayLike, orientation: ArrayLike = (0, 0, 0, 1), field: str = "placement"
    ) -> Placement:
        """The placement of values from outside, validated, its quaternion normalised.

        Args:
            position: (3,) position, metres.
            orientation: (4,) quaternion [x, y, z, w], of unit norm within `UNIT_TOLERANCE`.
            field: name of the field that holds the placement, for errors.

        Raises:
            InvalidInput: a wrong shape, a value that is not finite, a position too far from the
                origin, or a quaternion without unit norm.
        """
        quaternion = finite_array(f"{field}.orientation", orientation, (4,))
        norm = math.hypot(*quaternion)  # does not overflow for huge values
        if abs(norm - 1) > UNIT_TOLERANCE:
            reason = f"must be a unit quaternion [x, y, z, w], its norm is {norm:g}"
            raise InvalidInput(f"{field}.orientation", orientation, reason)
        return Placement(coordinates(f"{field}.position", position, (3,)), quaternion / norm)

    @staticmethod
    def of(transform: pin.SE3) -> Placement:
        """The placement of a pinocchio transform.

        Args:
            transform: pose in the planning frame, translation in m.
        """
        quaternion = pin.Quaternion(transform.rotation)
        quaternion.normalize()
        return Placement(transform.translation.copy(), quaternion.coeffs().copy())

    @property
    def transform(self) -> pin.SE3:
        """The placement as a pinocchio transform."""
        return pin.SE3(pin.Quaternion(self.orientation).matrix(), self.position)
