"""Planes in space, of one ring of points or of many at once: the same numbers to the last digit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TINY = 1e-300  # keeps a division finite where the quotient is not used


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane with a frame in it: columns of `axes` (3, 2) span it, `normal` (3,) is outward."""

    origin: Array
    axes: Array
    normal: Array

    def flatten(self, points: Array) -> Array:
        """Coordinates (n, 2) in the plane of points (n, 3)."""
        return np.asarray((points - self.origin) @ self.axes)

    def lift(self, points: Array) -> Array:
        """Points (n, 3) in space of coordinates (n, 2) in the plane."""
        return np.asarray(self.origin + points @ self.axes.T)


def plane_of(origin: Array, normal: Array) -> Plane:
    """The plane through a point (3,) with a unit normal (3,)."""
    return Plane(origin, plane_axes(normal[None])[0], normal)


def ring_planes(rings: Array) -> tuple[Array, Array, Array]:
    """The mean plane of each ring (g, v, 3), by Newell's method; its winding orients the normal.

    Returns:
        Origins (g, 3) in metres, unit normals (g, 3), areas (g,) in square metres. The normal of a
        ring without area is none.
    """
    origins = rings.mean(axis=1)
    arms = rings - origins[:, None]
    vectors = np.cross(arms, np.roll(arms, -1, axis=1)).sum(axis=1) / 2
    areas = _lengths(vectors)
    return origins, vectors / np.maximum(areas, TINY)[:, None], areas


def plane_axes(normals: Array) -> Array:
    """Orthonormal columns (g, 3, 2) that with unit normals (g, 3) make right-handed frames."""
    helpers = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(helpers, normals)
    first /= np.maximum(_lengths(first), TINY)[:, None]
    return np.stack([first, np.cross(normals, first)], axis=2)


def _lengths(vectors: Array) -> Array:
    """(g,) of vectors (g, 3). Not by `np.linalg.norm`: its sum differs with the number of rows."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=1)))
