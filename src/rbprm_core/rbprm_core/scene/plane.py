"""Planes in space, from one ring of points or from many at once, with bitwise equal results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rbprm_core.arrays import Array

TINY = 1e-300  # keeps a division finite where the quotient is not used


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane with a right-handed orthonormal frame in it.

    Attributes:
        origin: (3,) point of the plane, metres, planning frame.
        axes: (3, 2) matrix whose columns are unit vectors that span the plane.
        normal: (3,) outward unit normal.
    """

    origin: Array
    axes: Array
    normal: Array

    def flatten(self, points: Array) -> Array:
        """Return the coordinates (n, 2), metres, of points in the plane.

        Args:
            points: (n, 3) points, metres, planning frame; they are projected along the normal.
        """
        return np.asarray((points - self.origin) @ self.axes)

    def lift(self, points: Array) -> Array:
        """Return the points (n, 3), metres, planning frame, with given coordinates in the plane.

        Args:
            points: (n, 2) coordinates in the plane, metres.
        """
        return np.asarray(self.origin + points @ self.axes.T)


def plane_from_normal(origin: Array, normal: Array) -> Plane:
    """Return the plane through a point with a given normal.

    Args:
        origin: (3,) point of the plane, metres.
        normal: (3,) outward unit normal.
    """
    return Plane(origin, plane_axes(normal[None])[0], normal)


def ring_planes(rings: Array) -> tuple[Array, Array, Array]:
    r"""Return the mean plane of each ring by Newell's method.

    With vertices $p_i$ and their mean $c$, the vector area of a ring is
    $\frac{1}{2} \sum_i (p_i - c) \times (p_{i+1} - c)$. Its direction is the normal.

    Args:
        rings: (g, v, 3) closed rings of v vertices each, metres, counter-clockwise seen from
            outside.

    Returns:
        Origins (g, 3) in metres, outward unit normals (g, 3), and areas (g,) in square metres. The
        normal of a ring without area is zero or arbitrary.
    """
    origins = rings.mean(axis=1)
    arms = rings - origins[:, None]
    vectors = np.cross(arms, np.roll(arms, -1, axis=1)).sum(axis=1) / 2
    areas = _lengths(vectors)
    return origins, vectors / np.maximum(areas, TINY)[:, None], areas


def plane_axes(normals: Array) -> Array:
    """Return unit axes (g, 3, 2), as columns, that form right-handed frames with the normals.

    Args:
        normals: (g, 3) unit normals.
    """
    helpers = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(helpers, normals)
    first /= np.maximum(_lengths(first), TINY)[:, None]
    return np.stack([first, np.cross(normals, first)], axis=2)


def _lengths(vectors: Array) -> Array:
    """Return the length (g,) of each vector (g, 3).

    The sum in `np.linalg.norm` depends on the number of rows, so that it is not used here.
    """
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=1)))
