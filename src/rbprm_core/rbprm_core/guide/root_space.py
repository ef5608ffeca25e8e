"""The space of root configurations: bounds, distance and interpolation.

A root configuration is an array (7 + j,): position in metres, unit quaternion [x, y, z, w], then
the j joints that are planned with the root.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement

Array = NDArray[np.float64]

ANGLE_WEIGHT = 0.5  # metres that one radian of root rotation counts in distances
SMALL_ANGLE = 1e-6  # radians; arcs below it are straight to the last digit but one
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

    def contains_edge(self, a: Array, b: Array) -> bool:
        """True where every point of the way from a to b (`interpolate`) keeps all bounds.

        Positions and joints move on straight lines between bounds that are boxes: their ends
        suffice. Angles do not: the great arc between two orientations may leave a yaw, pitch and
        roll that both keep. Each of those bounds is broken or kept by the sign of a sinusoid of
        the angle turned (`_angle_bounds`); between two neighbouring roots of all of them nothing
        changes, so that one point of each stretch tells for all of it.
        """
        if not (self.contains(a) and self.contains(b)):
            return False
        shares = _crossings(a[3:7], b[3:7], self.bounds.half_ranges + BOUNDS_SLACK)
        if len(shares) == 0:
            return True
        ends = np.concatenate([[0.0], np.sort(shares), [1.0]])
        return all(
            self.contains(root) for root in StraightWay(a, b).at_all((ends[1:] + ends[:-1]) / 2)
        )

    def require(self, root: Array, pose: Placement, field: str) -> None:
        """Raise `InvalidInput` naming the field where a requested root breaks a bound."""
        broken = self.outside(root)
        if broken:
            value = [*pose.position.tolist(), *pose.orientation.tolist()]
            raise InvalidInput(field, value, f"{broken}; the request's root bounds exclude it")


def _crossings(p: Array, q: Array, half_ranges: Array) -> Array:
    """Shares (n,) of the great arc from quaternion p to q at which an angle may cross its bound.

    With R = Rz(yaw) Ry(pitch) Rx(roll) and an orientation that turns by phi about a fixed axis u,
    R(phi) = A + B cos(phi) + C sin(phi). Yaw crosses its bound a where R10 cos a -+ R00 sin a
    changes sign, roll its bound c where R21 cos c -+ R22 sin c does, pitch b where R20 +- sin b.
    """
    first, last = (pin.Quaternion(v).matrix() for v in (p, q))
    turn = pin.log3(first.T @ last)
    angle = float(np.linalg.norm(turn))
    if angle < 1e-9:
        return np.zeros(0)
    axis = pin.skew(turn / angle)
    cosine, sine = -first @ axis @ axis, first @ axis  # Rodrigues: I + sin K + (1 - cos) K K
    (ca, _, cc), (sa, sb, sc) = np.cos(half_ranges), np.sin(half_ranges)
    # One row a sinusoid, over R10, R00, R21, R22, R20.
    rows = np.zeros((6, 5))
    rows[:2, 0], rows[2:4, 2], rows[4:, 4] = ca, cc, 1.0
    rows[:2, 1], rows[2:4, 3] = (-sa, sa), (-sc, sc)
    entries = (1, 0, 2, 2, 2), (0, 0, 1, 2, 0)
    constant, c, s = (rows @ m[entries] for m in (first - cosine, cosine, sine))
    constant[4:] += (sb, -sb)
    size = np.hypot(c, s)
    crosses = size > np.abs(constant)
    middle = np.arctan2(s, c)[crosses]
    half = np.arccos(-constant[crosses] / size[crosses])
    shares = np.concatenate([middle + half, middle - half]) % (2 * np.pi) / angle
    return np.asarray(shares[shares < 1])


def distance(a: Array, b: Array) -> Array:
    """Distance (n,) in metres between configurations (n, 7 + j) and one (7 + j,)."""
    moved = np.linalg.norm(a[..., :3] - b[:3], axis=-1)
    turned = np.abs(a[..., 7:] - b[7:]).sum(axis=-1)
    return np.asarray(moved + ANGLE_WEIGHT * (turned_angle(a, b) + turned))


def turned_angle(a: Array, b: Array) -> Array:
    """Angle (n,) in radians between the orientations of configurations (n, 7 + j) and one."""
    # From the quaternions' difference: unlike the arc cosine of the dot product it is exact for
    # small angles.
    near = np.linalg.norm(a[..., 3:7] - b[3:7], axis=-1)
    far = np.linalg.norm(a[..., 3:7] + b[3:7], axis=-1)
    return np.asarray(4 * np.arcsin(np.minimum(np.minimum(near, far) / 2, 1.0)))


class StraightWay:
    """The way between two root configurations (7 + j,): a straight line in position and root
    joints, a great arc in orientation.

    Edges of guides are tested thousands of times a plan, a few points each: what depends on the
    ends alone is computed once, and one point without the overhead of arrays of points.

    Attributes:
        moved: metres between the positions. turned: radians between the orientations.
        joints_turned: (j,) how far each root joint moves.
    """

    def __init__(self, a: Array, b: Array) -> None:
        self._a, self._gap = a, b - a
        self._p, q = a[3:7], b[3:7]
        straight, flipped = self._gap[3:7], self._p + q  # q and -q are one orientation
        near, far = math.sqrt(straight @ straight), math.sqrt(flipped @ flipped)
        self._q = q if near <= far else -q
        self._half_angle = 2 * math.asin(min(min(near, far) / 2, 1.0))
        self.moved = math.sqrt(self._gap[:3] @ self._gap[:3])
        self.turned = 2 * self._half_angle
        self.joints_turned = np.abs(self._gap[7:])

    @property
    def length(self) -> float:
        """`distance` between the ends, metres."""
        joints = float(self.joints_turned.sum()) if len(self.joints_turned) else 0.0
        return self.moved + ANGLE_WEIGHT * (self.turned + joints)

    def at(self, t: float) -> Array:
        """The root configuration (7 + j,) at a share t of the way, in [0, 1]."""
        root = self._a + t * self._gap
        angle = self._half_angle
        if angle < SMALL_ANGLE:
            mixed = (1 - t) * self._p + t * self._q
        else:
            mixed = math.sin((1 - t) * angle) * self._p + math.sin(t * angle) * self._q
        root[3:7] = mixed / math.sqrt(mixed @ mixed)
        return np.asarray(root)

    def at_all(self, shares: Array) -> Array:
        """The root configurations (n, 7 + j) at shares (n,) of the way."""
        t = shares[:, None]
        roots = self._a + t * self._gap
        angle = self._half_angle
        if angle < SMALL_ANGLE:
            mixed = (1 - t) * self._p + t * self._q
        else:
            mixed = np.sin((1 - t) * angle) * self._p + np.sin(t * angle) * self._q
        roots[:, 3:7] = mixed / np.sqrt((mixed * mixed).sum(axis=1))[:, None]
        return np.asarray(roots)
