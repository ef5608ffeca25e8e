"""The ground under a guide, seen from above: how high it is, and where the nearest of it is."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from rbprm_core.scene import Scene
from rbprm_core.surface_kind import SurfaceKind

Array = NDArray[np.float64]


class Ground:
    """The support surfaces of a scene in plan, in a tree of their outlines.

    Args:
        reach: metres; ground farther than this from a point is none.
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
        """Height (n,) of the highest surface in the plumb line of each point (n, 3).

        Surfaces above the point's own ceiling (n,) do not count; NaN where there is none.
        """
        best = np.full(len(points), -np.inf)
        point, piece = self._tree.query(shapely.points(points[:, :2]), predicate="intersects")
        z = self._height_of(piece, points[point])
        below = z < ceilings[point]
        np.maximum.at(best, point[below], z[below])
        return np.where(np.isfinite(best), best, np.nan)

    def ways_to(self, points: Array, ceilings: Array) -> Array:
        """Horizontal way (n, 2) from each point (n, 3) to the nearest ground, metres.

        Zero where that is above the point's own ceiling (n,) or out of reach.
        """
        ways = np.zeros((len(points), 2))
        flat = shapely.points(points[:, :2])
        point, piece = self._tree.query_nearest(flat, max_distance=self._reach, all_matches=False)
        if len(point):
            lines = shapely.shortest_line(flat[point], self._outlines[piece])
            ends = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 1]
            below = self._height_of(piece, ends) < ceilings[point]
            ways[point[below]] = (ends - points[point, :2])[below]
        return ways

    def _height_of(self, piece: NDArray[np.int_], points: Array) -> Array:
        """Height (n,) of the planes of some pieces (n,) at points (n, 2 or 3)."""
        n = self._pieces.normals[piece]
        level = n[:, 0] * points[:, 0] + n[:, 1] * points[:, 1]
        return np.asarray((self._pieces.offsets[piece] - level) / n[:, 2])
