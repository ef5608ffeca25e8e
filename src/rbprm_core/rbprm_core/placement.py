"""A placement in SE(3): position in metres and unit quaternion [x, y, z, w], as in ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.validation import coordinates, finite_array

UNIT_TOLERANCE = 1e-3  # messages carry quaternions that were normalised in single precision


@dataclass(frozen=True, eq=False)
class Placement:
    """Position (3,) in metres and orientation (4,) as unit quaternion [x, y, z, w]."""

    position: NDArray[np.float64]
    orientation: NDArray[np.float64]

    @staticmethod
    def parse(
        position: ArrayLike, orientation: ArrayLike = (0, 0, 0, 1), field: str = "placement"
    ) -> Placement:
        """Validated placement; the quaternion is normalised.

        Raises:
            InvalidInput: wrong shape, not finite, zero or far from unit quaternion.
        """
        quaternion = finite_array(f"{field}.orientation", orientation, (4,))
        norm = math.hypot(*quaternion)  # of huge values too, without an overflow
        if abs(norm - 1) > UNIT_TOLERANCE:
            reason = f"must be a unit quaternion [x, y, z, w], its norm is {norm:g}"
            raise InvalidInput(f"{field}.orientation", orientation, reason)
        return Placement(coordinates(f"{field}.position", position, (3,)), quaternion / norm)

    @staticmethod
    def of(transform: pin.SE3) -> Placement:
        """From a pinocchio transform."""
        quaternion = pin.Quaternion(transform.rotation)
        quaternion.normalize()
        return Placement(transform.translation.copy(), quaternion.coeffs().copy())

    @property
    def transform(self) -> pin.SE3:
        """As a pinocchio transform."""
        return pin.SE3(pin.Quaternion(self.orientation).matrix(), self.position)
