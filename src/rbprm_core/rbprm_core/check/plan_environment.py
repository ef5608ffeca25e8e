"""The environment of a plan as triangles, read from the meshes and polygons that the plan names."""

from __future__ import annotations

import coal
import numpy as np
import trimesh
from shapely.geometry import Polygon

from rbprm_core.arrays import Array, IntArray
from rbprm_core.check.triangle_geometry import (
    INSIDE,
    by_corner,
    collision_mesh,
    components,
    mesh_triangles,
    triangle_distances,
    winding_number,
)
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry, MeshEntry, SurfaceEntry
from rbprm_core.resources import find_resource

MIN_AREA = 1e-12  # square metres; smaller triangles have no reliable normal
PLANAR_BOUND = 1e-3  # metres that a vertex of a polygon may lie off its plane


class Environment:
    """All triangles of a plan's environment, in metres in the planning frame.

    A piece is a connected component of the triangles, such as one box or one polygon.

    Args:
        entry: environment of the plan.

    Attributes:
        triangles: (n, 3, 3) triangles of all meshes and polygons.
        normals: (n, 3) outward unit normals.
        friction: (n,) coefficients of Coulomb friction; infinite where the plan declares none.
        bvh: coal mesh of the triangles, in the same order.
        pieces: indices of the triangles of every piece.
        piece_points: (k, 3) one corner of every piece.

    Raises:
        InvalidInput: a mesh is missing or malformed, a rotation is not a rotation matrix, a polygon
            is not planar or intersects itself, or there is no triangle at all.
    """

    def __init__(self, entry: EnvironmentEntry) -> None:
        field = "environment"
        parts = [_mesh(m, f"{field}.meshes.{k}") for k, m in enumerate(entry.meshes)]
        parts += [_polygon(s, f"{field}.surfaces.{k}") for k, s in enumerate(entry.surfaces)]
        triangles = np.concatenate([np.zeros((0, 3, 3)), *parts])
        declared = [_friction(mesh) for mesh in entry.meshes]
        declared += [_friction(surface) for surface in entry.surfaces]
        friction = np.repeat(declared, [len(part) for part in parts])
        doubled = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        areas = np.linalg.norm(doubled, axis=1) / 2
        kept = areas > MIN_AREA
        self.triangles: Array = triangles[kept]
        self.normals: Array = doubled[kept] / (2 * areas[kept, None])
        self.friction: Array = friction[kept]
        if not len(self.triangles):
            raise InvalidInput(field, entry.name, "has neither a mesh nor a surface")
        self.bvh = collision_mesh(self.triangles)
        self.pieces = components(self.triangles)
        self._piece_corners = [by_corner(self.triangles[piece]) for piece in self.pieces]
        self._low, self._high = self.triangles.min(axis=1), self.triangles.max(axis=1)
        self.piece_points = np.array([self.triangles[piece[0], 0] for piece in self.pieces])
        self._piece_low = np.array([self._low[piece].min(axis=0) for piece in self.pieces])
        self._piece_high = np.array([self._high[piece].max(axis=0) for piece in self.pieces])

    def near(self, low: Array, high: Array) -> IntArray:
        """Return the indices of the triangles whose bounding boxes meet a box.

        Args:
            low: (3,) lowest corner of the box, metres.
            high: (3,) highest corner of the box, metres.
        """
        return np.flatnonzero(((self._low <= high) & (self._high >= low)).all(axis=1))

    def distances(self, point: Array, radius: float) -> tuple[IntArray, Array]:
        """Return the indices (k,) of the triangles within a radius, and their distances (k,).

        Args:
            point: (3,) point, metres.
            radius: greatest distance from the point, metres.
        """
        candidates = self.near(point - radius, point + radius)
        distances = triangle_distances(self.triangles[candidates], point)
        within = distances <= radius
        return candidates[within], distances[within]

    def distance(self, point: Array) -> float:
        """Return the distance of a point from the nearest triangle, metres.

        Args:
            point: (3,) point, metres.
        """
        return float(self.distances(point, np.inf)[1].min())

    def contains(self, point: Array) -> bool:
        """Return whether a point is inside one of the pieces.

        The winding number of a closed piece is 1 inside and 0 outside. A piece without a bottom
        face, which is common in meshes of terrain, still has more than 0.5 inside. Bounding boxes
        rule out open pieces correctly too: seen from outside its convex hull, a piece covers less
        than half of the sphere of directions.

        Args:
            point: (3,) point, metres.
        """
        around = ((self._piece_low <= point) & (point <= self._piece_high)).all(axis=1)
        return any(
            winding_number(self._piece_corners[k], point) > INSIDE for k in np.flatnonzero(around)
        )


def _friction(entry: MeshEntry | SurfaceEntry) -> float:
    """Return the declared coefficient of friction, infinity if the plan declares none."""
    return entry.friction if "friction" in entry.model_fields_set else np.inf


def _mesh(entry: MeshEntry, field: str) -> Array:
    """Return the triangles (n, 3, 3) of a mesh file at its pose."""
    rotation = np.array(entry.rotation, dtype=float)
    proper = (
        np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) and np.linalg.det(rotation) > 0
    )
    if not proper:
        raise InvalidInput(f"{field}.rotation", entry.rotation, "is not a rotation matrix")
    path = find_resource(entry.file, f"{field}.file")
    try:
        loaded = coal.MeshLoader().load(str(path), np.ones(3))
    except (ValueError, RuntimeError) as error:
        raise InvalidInput(f"{field}.file", entry.file, f"cannot be loaded: {error}") from error
    moved = mesh_triangles(loaded) @ rotation.T + np.array(entry.translation, dtype=float)
    return np.asarray(moved, dtype=float)


def _polygon(entry: SurfaceEntry, field: str) -> Array:
    """Return the triangles (n, 3, 3) of a polygon with holes, which need not be convex."""
    origin, axes = _polygon_frame(entry, field)
    for k, hole in enumerate(entry.holes):
        if len(hole) < 3:
            raise InvalidInput(f"{field}.holes.{k}", hole, "has fewer than three points")
    vertices = np.array(entry.vertices, dtype=float).reshape(-1, 3)
    rings = [(ring - origin) @ axes.T for ring in (vertices, *map(np.array, entry.holes))]
    if max(float(np.abs(ring[:, 2]).max()) for ring in rings) > PLANAR_BOUND:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "is not planar")
    polygon = Polygon(rings[0][:, :2], [ring[:, :2] for ring in rings[1:]])
    if not polygon.is_valid:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "crosses itself or its holes")
    flat, faces = trimesh.creation.triangulate_polygon(polygon, engine="earcut")
    corners = np.array(flat)[np.array(faces)]
    clockwise = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    corners[clockwise] = corners[clockwise][:, ::-1]
    return np.asarray(corners @ axes[:2] + origin, dtype=float)


def _polygon_frame(entry: SurfaceEntry, field: str) -> tuple[Array, Array]:
    """Return origin (3,) and axes (3, 3), as rows, of a frame on a polygon; the last is its normal.

    The normal follows from the vector area, which is half of the sum of the cross products of
    neighbouring vertices.
    """
    vertices = np.array(entry.vertices, dtype=float).reshape(-1, 3)
    if len(vertices) < 3:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "must have 3 vertices or more")
    origin = vertices.mean(axis=0)
    area = np.cross(vertices - origin, np.roll(vertices - origin, -1, axis=0)).sum(axis=0)
    if np.linalg.norm(area) < MIN_AREA:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "has no area")
    normal = area / np.linalg.norm(area)
    seed = np.eye(3)[int(np.argmin(np.abs(normal)))]
    x = np.cross(seed, normal) / np.linalg.norm(np.cross(seed, normal))
    return origin, np.array([x, np.cross(normal, x), normal])
