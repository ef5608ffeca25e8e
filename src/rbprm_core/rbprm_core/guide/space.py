"""The space of root configurations: bounds, distance and interpolation.

A root configuration is an array (7 + j,): position in metres, unit quaternion [x, y, z, w], then
the j joints that are planned with the root.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement

Array = NDArray[np.float64]

ANGLE_WEIGHT = 0.5  # metres that one radian of root rotation counts in distances
BOUNDS_SLACK = 1e-6  # metres and radians; a start on its bound is inside


@dataclass(frozen=True, eq=False)
class RootBounds:
    """Where the root may be.

    Attributes:
        low, high: (3,) position, metres.
        half_ranges: (3,) largest absolute yaw, pitch and roll (about z, y, x), radians.
    """

    low: Array
    high: Array
    half_ranges: Array


class RootSpace:
    """Bounded root configurations.

    Args:
        bounds: of the pose. joint_low, joint_high: (j,) limits of the joints planned along.
    """

    def __init__(self, bounds: RootBounds, joint_low: Array, joint_high: Array) -> None:
        self.bounds = bounds
        self.joint_low, self.joint_high = joint_low, joint_high

    def contains(self, root: Array) -> bool:
        """True where a root configuration keeps all bounds."""
        return self.outside(root) == ""

    def outside(self, root: Array) -> str:
        """Name of the first bound that a root configuration breaks, "" where it keeps them all."""
        slack = BOUNDS_SLACK
        below, above = root[:3] < self.bounds.low - slack, root[:3] > self.bounds.high + slack
        if below.any() or above.any():
            axis = int(np.argmax(below | above))
            low, high = self.bounds.low[axis], self.bounds.high[axis]
            return f"{'xyz'[axis]} = {root[axis]:g} m is outside [{low:g}, {high:g}]"
        angles = np.abs(pin.rpy.matrixToRpy(pin.Quaternion(root[3:7]).matrix())[::-1])
        over = angles > self.bounds.half_ranges + slack
        if over.any():
            axis = int(np.argmax(over))
            most = self.bounds.half_ranges[axis]
            name = ("yaw", "pitch", "roll")[axis]
            return f"|{name}| = {angles[axis]:g} rad is over {most:g}"
        joints = root[7:]
        if (joints < self.joint_low - slack).any() or (joints > self.joint_high + slack).any():
            return f"root joints {joints.tolist()} are outside their limits"
        return ""

    def require(self, root: Array, pose: Placement, field: str) -> None:
        """Raise `InvalidInput` naming the field where a requested root breaks a bound."""
        broken = self.outside(root)
        if broken:
            value = [*pose.position.tolist(), *pose.orientation.tolist()]
            raise InvalidInput(field, value, f"{broken}; the request's root bounds exclude it")


def distance(a: Array, b: Array) -> Array:
    """Distance (n,) in metres between configurations (n, 7 + j) and one (7 + j,)."""
    moved = np.linalg.norm(a[..., :3] - b[:3], axis=-1)
    # The angle between two rotations from their quaternions' difference: unlike the arc cosine of
    # the dot product it is exact for small angles.
    near = np.linalg.norm(a[..., 3:7] - b[3:7], axis=-1)
    far = np.linalg.norm(a[..., 3:7] + b[3:7], axis=-1)
    angle = 4 * np.arcsin(np.minimum(np.minimum(near, far) / 2, 1.0))
    turned = np.abs(a[..., 7:] - b[7:]).sum(axis=-1)
    return np.asarray(moved + ANGLE_WEIGHT * (angle + turned))


def interpolate(a: Array, b: Array, t: float) -> Array:
    """Straight line in position and root joints, great arc in orientation; t in [0, 1]."""
    root = a + t * (b - a)
    p, q = a[3:7], b[3:7]
    cosine = float(p @ q)
    if cosine < 0:
        q, cosine = -q, -cosine
    if cosine > 1 - 1e-9:
        mixed = p + t * (q - p)
    else:
        angle = np.arccos(cosine)
        mixed = (np.sin((1 - t) * angle) * p + np.sin(t * angle) * q) / np.sin(angle)
    root[3:7] = mixed / np.linalg.norm(mixed)
    return root
