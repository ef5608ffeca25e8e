"""Planar polygons in space: validation, plane and convex pieces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import mapbox_earcut
import numpy as np
import shapely
from numpy.typing import ArrayLike

from rbprm_core.arrays import Array, BoolArray, IntArray
from rbprm_core.errors import InvalidInput
from rbprm_core.scene.plane import Plane, plane_from_normal, ring_planes
from rbprm_core.validation import coordinates

Indices = tuple[int, ...]

PLANAR_TOLERANCE = 8e-4  # metres; slightly less than the bound of the plan check
SAME_POINT = 1e-9  # metres; neighbouring vertices closer than this are one vertex
MIN_AREA = 1e-8  # square metres
STRAIGHT = 1e-9  # sine of the angle below which two edges count as one line


@dataclass(frozen=True, eq=False)
class Polygon:
    """A valid planar polygon, in metres in the planning frame.

    Attributes:
        plane: plane of the polygon.
        boundary: (v, 3) vertices, counter-clockwise seen from outside.
        holes: vertices of each hole, (h, 3), clockwise seen from outside.
        pieces: vertices of each convex piece, (m, 3), counter-clockwise seen from outside.
        outer_edges: flags (m,) of each piece, True where the edge from vertex i to i + 1 lies on
            the polygon's boundary and False where it is shared with another piece.
        area: area in square metres.
    """

    plane: Plane
    boundary: Array
    holes: tuple[Array, ...]
    pieces: tuple[Array, ...]
    outer_edges: tuple[BoolArray, ...]
    area: float

    def shrunk(self, margin: float) -> shapely.Polygon:
        """Return the polygon in coordinates of its plane, shrunk along its whole boundary.

        Args:
            margin: distance by which the boundary moves inwards, metres; negative to grow. Corners
                stay sharp (mitred).
        """
        return _shrunk(self, margin)


@lru_cache(maxsize=4096)
def _shrunk(polygon: Polygon, margin: float) -> shapely.Polygon:
    flatten = polygon.plane.flatten
    flat = shapely.Polygon(flatten(polygon.boundary), [flatten(hole) for hole in polygon.holes])
    inner = flat.buffer(-margin, join_style="mitre")
    shapely.prepare(inner)
    return inner


def make_polygon(
    vertices: ArrayLike, holes: tuple[ArrayLike, ...] = (), field: str = "polygon"
) -> Polygon:
    """Return a validated polygon, cut into convex pieces.

    Args:
        vertices: (v, 3) boundary, metres; its winding gives the outward normal (right-hand rule).
        holes: vertices of each hole, (h, 3), metres, in any winding.
        field: name of the polygon in errors, to which `vertices` or `holes` is appended.

    Raises:
        InvalidInput: a ring is not finite, has fewer than three distinct points or no area, is not
            planar or intersects itself, or a hole is not inside the boundary.
    """
    name = f"{field}.vertices"
    boundary = _distinct(coordinates(name, vertices, (-1, 3)), name)
    rings = tuple(
        _distinct(coordinates(f"{field}.holes.{i}", h, (-1, 3)), f"{field}.holes.{i}")
        for i, h in enumerate(holes)
    )
    plane = _plane(boundary, name)
    for ring in (boundary, *rings):
        off = np.abs((ring - plane.origin) @ plane.normal).max()
        if off > PLANAR_TOLERANCE:
            reason = f"is not planar: a vertex is {off:.4g} m off its plane"
            reason += f" (at most {PLANAR_TOLERANCE:g} m)"
            raise InvalidInput(name, vertices, reason)
    flat = shapely.Polygon(plane.flatten(boundary), [plane.flatten(ring) for ring in rings])
    if not flat.is_valid:
        reason = f"is not a simple polygon: {shapely.is_valid_reason(flat)} (in its plane)"
        raise InvalidInput(name, vertices, reason)
    return polygon_from_shape(shapely.geometry.polygon.orient(flat), plane)


def polygon_from_shape(flat: shapely.Polygon, plane: Plane) -> Polygon:
    """Return the polygon of a valid shape in the coordinates of a plane.

    Args:
        flat: polygon in coordinates of the plane, metres, its exterior counter-clockwise.
        plane: plane of the polygon.
    """
    shell = np.asarray(flat.exterior.coords)[:-1]
    rings = [np.asarray(ring.coords)[:-1] for ring in flat.interiors]
    points = np.vstack([shell, *rings])
    ends = np.cumsum([len(shell), *(len(ring) for ring in rings)]).astype(np.uint32)
    triangles = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3).astype(int)
    parts = convex_parts(points, triangles)
    lifted = plane.lift(points)
    border = set(_ring_edges(0, len(shell)))
    for start, end in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        border.update(_ring_edges(start, end))
    return Polygon(
        plane=plane,
        boundary=plane.lift(shell),
        holes=tuple(plane.lift(ring) for ring in rings),
        pieces=tuple(lifted[list(part)] for part in parts),
        outer_edges=tuple(
            np.array([edge in border for edge in zip(part, _next(part), strict=True)])
            for part in parts
        ),
        area=float(flat.area),
    )


def convex_parts(points: Array, triangles: IntArray) -> list[Indices]:
    """Return convex polygons merged from triangles across shared edges.

    Hertel and Mehlhorn 1983: at most four times the smallest possible number of parts.

    Args:
        points: (n, 2) vertices, metres.
        triangles: (t, 3) indices of the vertices of each triangle, in any winding.

    Returns:
        Indices of the vertices of each part, counter-clockwise.
    """
    parts: dict[int, Indices] = {}
    edges: dict[tuple[int, int], int] = {}
    for k, (a, b, c) in enumerate(triangles.tolist()):
        turn = _cross(points[b] - points[a], points[c] - points[b])
        parts[k] = (a, b, c) if turn > 0 else (a, c, b)
        edges.update(dict.fromkeys(zip(parts[k], _next(parts[k]), strict=True), k))
    for a, b in list(edges):
        left, right = edges.get((a, b)), edges.get((b, a))
        if left is None or right is None or left == right:
            continue
        merged = _joined(parts[left], parts[right], a, b)
        if _is_convex(points, merged):
            parts[left] = merged
            del parts[right], edges[a, b], edges[b, a]
            edges.update(dict.fromkeys(zip(merged, _next(merged), strict=True), left))
    return list(parts.values())


def _joined(left: Indices, right: Indices, a: int, b: int) -> Indices:
    """Return one ring from two that share an edge, a to b in `left` and b to a in `right`."""
    at_b, at_a = left.index(b), right.index(a)
    around_left = left[at_b:] + left[:at_b]  # b … a
    around_right = right[at_a:] + right[:at_a]  # a … b
    return around_left + around_right[1:-1]


def _is_convex(points: Array, ring: Indices) -> bool:
    """Return whether no corner turns right; straight corners are allowed."""
    corner = points[list(ring)]
    edge = np.roll(corner, -1, axis=0) - corner
    after = np.roll(edge, -1, axis=0)
    turn = edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0]
    scale = np.linalg.norm(edge, axis=1) * np.linalg.norm(after, axis=1)
    return bool((turn >= -STRAIGHT * scale).all())


def _ring_edges(start: int, end: int) -> Iterator[tuple[int, int]]:
    """Yield the edges of the ring with vertices start, …, end - 1."""
    for i in range(start, end):
        yield i, i + 1 if i + 1 < end else start


def _next(ring: Indices) -> Indices:
    """Return the vertex after each vertex of a ring."""
    return ring[1:] + ring[:1]


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _distinct(ring: Array, field: str) -> Array:
    """Return the ring without repeated neighbouring points."""
    if len(ring):
        ring = ring[np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1) > SAME_POINT]
    if len(np.unique(ring, axis=0)) < 3:
        raise InvalidInput(field, ring.tolist(), "needs at least three distinct points")
    return ring


def _plane(ring: Array, field: str) -> Plane:
    """Return the plane of a ring (v, 3)."""
    origins, normals, areas = ring_planes(ring[None])
    if areas[0] < MIN_AREA:
        reason = f"has no area ({areas[0]:.3g} m^2): its points lie on a line or its loops cancel"
        raise InvalidInput(field, ring.tolist(), reason)
    return plane_from_normal(origins[0], normals[0])
