"""The space of root configurations: bounds, distance and interpolation.

A root configuration is an array (7 + j,): position in metres, unit quaternion [x, y, z, w], then
the j joints that are planned with the root (radians, or metres for joints that slide).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement

ANGLE_WEIGHT = 0.5  # m per rad of root rotation or joint motion, in distances
SMALL_ANGLE = 1e-6  # rad; below it linear interpolation of a great arc is exact to rounding
BOUNDS_SLACK = 1e-6  # m and rad; a start on its bound is inside


@dataclass(frozen=True, eq=False)
class RootBounds:
    """Bounds of the root's pose.

    Attributes:
        low: (3,) lowest position in the planning frame, m.
        high: (3,) highest position in the planning frame, m.
        half_ranges: (3,) largest absolute yaw, pitch and roll (about z, y, x), rad.
    """

    low: Array
    high: Array
    half_ranges: Array


class RootSpace:
    """Bounded root configurations.

    Args:
        bounds: bounds of the root's pose.
        joint_low: (j,) lower limits of the joints planned with the root, rad or m.
        joint_high: (j,) upper limits of the joints planned with the root, rad or m.
    """

    def __init__(self, bounds: RootBounds, joint_low: Array, joint_high: Array) -> None:
        self.bounds = bounds
        self.joint_low, self.joint_high = joint_low, joint_high

    def contains(self, root: Array) -> bool:
        """True where a root configuration keeps all bounds.

        Args:
            root: (7 + j,) root configuration.
        """
        return self.outside(root) == ""

    def outside(self, root: Array) -> str:
        """Text that names the first bound broken by a root configuration; "" where it keeps all.

        Args:
            root: (7 + j,) root configuration.
        """
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
            limit = self.bounds.half_ranges[axis]
            name = ("yaw", "pitch", "roll")[axis]
            return f"|{name}| = {angles[axis]:g} rad is over {limit:g}"
        joints = root[7:]
        if (joints < self.joint_low - slack).any() or (joints > self.joint_high + slack).any():
            return f"root joints {joints.tolist()} are outside their limits"
        return ""

    def contains_segment(self, a: Array, b: Array) -> bool:
        """True where every point of the segment from a to b (`RootSegment`) keeps all bounds.

        Positions and joints move on straight lines between bounds that are boxes, so testing the
        ends suffices. Yaw, pitch and roll do not: the great arc between two orientations may leave
        a bound that both keep. The sign of a sinusoid of the rotation angle says whether such a
        bound is kept (`_crossings`). Between two neighbouring roots of these sinusoids no sign
        changes, so that testing one point of each interval is exact.

        Args:
            a: (7 + j,) first root configuration.
            b: (7 + j,) last root configuration.
        """
        if not (self.contains(a) and self.contains(b)):
            return False
        shares = _crossings(a[3:7], b[3:7], self.bounds.half_ranges + BOUNDS_SLACK)
        if len(shares) == 0:
            return True
        ends = np.concatenate([[0.0], np.sort(shares), [1.0]])
        return all(
            self.contains(root) for root in RootSegment(a, b).at_all((ends[1:] + ends[:-1]) / 2)
        )

    def require(self, root: Array, pose: Placement, field: str) -> None:
        """Raise an error where a requested root configuration breaks a bound.

        Args:
            root: (7 + j,) root configuration.
            pose: pose as the request gives it, for the error.
            field: name of the request's field that holds the pose, for the error.

        Raises:
            InvalidInput: the root configuration breaks a bound.
        """
        broken = self.outside(root)
        if broken:
            value = [*pose.position.tolist(), *pose.orientation.tolist()]
            raise InvalidInput(field, value, f"{broken}; the request's root bounds exclude it")


def _crossings(p: Array, q: Array, half_ranges: Array) -> Array:
    r"""Shares (n,) in [0, 1) of the great arc from p to q at which an angle may cross its bound.

    With $R = R_z(\psi) R_y(\theta) R_x(\phi)$ for yaw, pitch and roll, and an orientation that
    rotates by $\alpha$ about a fixed axis, $R(\alpha) = A + B \cos\alpha + C \sin\alpha$. Yaw
    crosses its bound $\bar\psi$ where $R_{10} \cos\bar\psi \mp R_{00} \sin\bar\psi$ changes sign,
    roll its bound $\bar\phi$ where $R_{21} \cos\bar\phi \mp R_{22} \sin\bar\phi$ does, and pitch
    its bound $\bar\theta$ where $R_{20} \pm \sin\bar\theta$ does.

    Args:
        p: (4,) first unit quaternion [x, y, z, w].
        q: (4,) last unit quaternion [x, y, z, w].
        half_ranges: (3,) bounds of the absolute yaw, pitch and roll, rad.
    """
    first, last = (pin.Quaternion(v).matrix() for v in (p, q))
    turn = pin.log3(first.T @ last)
    angle = float(np.linalg.norm(turn))
    if angle < 1e-9:
        return np.zeros(0)
    axis = pin.skew(turn / angle)
    # Rodrigues' formula: I + sin K + (1 - cos) K K.
    cosine, sine = -first @ axis @ axis, first @ axis
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
    r"""Distance (n,) in metres between root configurations.

    $\|p_a - p_b\| + w \, (\alpha + \sum_i |q_{a,i} - q_{b,i}|)$ with positions $p$, the angle
    $\alpha$ between the orientations, joints $q$ and $w$ = `ANGLE_WEIGHT`.

    Args:
        a: (n, 7 + j) root configurations, or one (7 + j,).
        b: (7 + j,) root configuration.
    """
    moved = np.linalg.norm(a[..., :3] - b[:3], axis=-1)
    joint_motion = np.abs(a[..., 7:] - b[7:]).sum(axis=-1)
    return np.asarray(moved + ANGLE_WEIGHT * (rotation_angle(a, b) + joint_motion))


def rotation_angle(a: Array, b: Array) -> Array:
    """Angle (n,) in radians between the orientations of root configurations.

    Args:
        a: (n, 7 + j) root configurations, or one (7 + j,).
        b: (7 + j,) root configuration.
    """
    # From the quaternions' difference: unlike the arc cosine of the dot product it is exact for
    # small angles.
    near = np.linalg.norm(a[..., 3:7] - b[3:7], axis=-1)
    far = np.linalg.norm(a[..., 3:7] + b[3:7], axis=-1)
    return np.asarray(4 * np.arcsin(np.minimum(np.minimum(near, far) / 2, 1.0)))


class RootSegment:
    """Segment between two root configurations.

    Position and joints move on a straight line, the orientation on a great arc.

    Edges of guides are tested thousands of times in a plan, at a few points each. What depends on
    the ends alone is therefore computed once, and a single point without the overhead of arrays of
    points.

    Args:
        a: (7 + j,) first root configuration.
        b: (7 + j,) last root configuration.

    Attributes:
        moved: distance between the positions, m.
        turned: angle between the orientations, rad.
        joint_motion: (j,) absolute motion of each joint, rad or m.
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
        self.joint_motion = np.abs(self._gap[7:])

    @property
    def length(self) -> float:
        """Length in metres: the `distance` between the ends."""
        joints = float(self.joint_motion.sum()) if len(self.joint_motion) else 0.0
        return self.moved + ANGLE_WEIGHT * (self.turned + joints)

    def at(self, share: float) -> Array:
        """Root configuration (7 + j,) at a share of the segment.

        Args:
            share: in [0, 1], from the first end to the last.
        """
        root = self._a + share * self._gap
        angle = self._half_angle
        if angle < SMALL_ANGLE:
            mixed = (1 - share) * self._p + share * self._q
        else:
            mixed = math.sin((1 - share) * angle) * self._p + math.sin(share * angle) * self._q
        root[3:7] = mixed / math.sqrt(mixed @ mixed)
        return np.asarray(root)

    def at_all(self, shares: Array) -> Array:
        """Root configurations (n, 7 + j) at shares of the segment.

        Args:
            shares: (n,) in [0, 1], from the first end to the last.
        """
        t = shares[:, None]
        roots = self._a + t * self._gap
        angle = self._half_angle
        if angle < SMALL_ANGLE:
            mixed = (1 - t) * self._p + t * self._q
        else:
            mixed = np.sin((1 - t) * angle) * self._p + np.sin(t * angle) * self._q
        roots[:, 3:7] = mixed / np.sqrt((mixed * mixed).sum(axis=1))[:, None]
        return np.asarray(roots)
