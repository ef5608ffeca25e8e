"""Terrain below a guide, seen from above: its height, and the nearest point of it."""

from __future__ import annotations

import numpy as np
import shapely

from rbprm_core.arrays import Array, IntArray
from rbprm_core.scene import Scene
from rbprm_core.surface_kind import SurfaceKind


class Terrain:
    """Support surfaces of a scene in plan view, in a search tree of their outlines.

    Args:
        scene: scene with the surfaces.
        reach: largest horizontal distance at which `offsets` finds a surface, m.
    """

    def __init__(self, scene: Scene, reach: float) -> None:
        self._reach = reach
        self._pieces = scene.pieces((SurfaceKind.SUPPORT,))
        rings = [
            piece[:, :2]
            for surface in scene.surfaces
            if surface.kind is SurfaceKind.SUPPORT
            for piece in surface.polygon.pieces
        ]
        self._outlines = np.array([shapely.Polygon(ring) for ring in rings], dtype=object)
        self._tree = shapely.STRtree(self._outlines)

    def heights(self, points: Array, ceilings: Array) -> Array:
        """Height (n,) in metres of the highest surface vertically above or below each point.

        NaN where there is none.

        Args:
            points: (n, 3) points in the planning frame, m.
            ceilings: (n,) heights; surfaces above its ceiling do not count for a point, m.
        """
        best = np.full(len(points), -np.inf)
        point, piece = self._tree.query(shapely.points(points[:, :2]), predicate="intersects")
        z = self._height_of(piece, points[point])
        below = z < ceilings[point]
        np.maximum.at(best, point[below], z[below])
        return np.where(np.isfinite(best), best, np.nan)

    def offsets(self, points: Array, ceilings: Array) -> Array:
        """Horizontal offset (n, 2) in metres from each point to the nearest surface.

        Zero where that surface is above the point's ceiling, or none is within reach.

        Args:
            points: (n, 3) points in the planning frame, m.
            ceilings: (n,) heights, m.
        """
        offsets = np.zeros((len(points), 2))
        flat = shapely.points(points[:, :2])
        point, piece = self._tree.query_nearest(flat, max_distance=self._reach, all_matches=False)
        if len(point):
            lines = shapely.shortest_line(flat[point], self._outlines[piece])
            ends = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 1]
            below = self._height_of(piece, ends) < ceilings[point]
            offsets[point[below]] = (ends - points[point, :2])[below]
        return offsets

    def _height_of(self, piece: IntArray, points: Array) -> Array:
        """Height (n,) of the planes of pieces (n,) at points (n, 2 or 3), m."""
        n = self._pieces.normals[piece]
        level = n[:, 0] * points[:, 0] + n[:, 1] * points[:, 1]
        return np.asarray((self._pieces.offsets[piece] - level) / n[:, 2])
