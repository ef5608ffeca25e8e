"""The environment of a plan as triangles: what is near a point, and what is inside a solid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import coal
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry import Polygon

from rbprm_core.check.poses import angle_between
from rbprm_core.check.report import Kind, Violation
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactEntry, EnvironmentEntry, MeshEntry, SurfaceEntry
from rbprm_core.resources import find_resource

CONTACT_BOUND = 3e-3
NORMAL_BOUND = np.deg2rad(3.0)
FRICTION_SLACK = 1e-6  # a coefficient may have passed through single precision
MIN_AREA = 1e-12  # m^2: a sliver below it has no normal worth the name
PLANAR_BOUND = 1e-3  # m: vertices of a polygon off its plane
MERGE = 1e-6  # m: corners that near are one vertex
INSIDE = 0.5  # of a winding number

Triangles = NDArray[np.float64]
"""Corners (n, 3, 3): triangle, corner, axis; metres; counter-clockwise seen from outside."""


class Environment:
    """All triangles of a plan's environment.

    Attributes:
        triangles: of all meshes and polygons, planning frame.
        normals: outward unit normals (n, 3).
        friction: coefficients (n,); infinite where the plan declares none.
        bvh: the triangles for collision queries, in the same order.
        bodies: indices of the triangles of every connected piece.
        body_points: a corner (k, 3) of every piece, metres.

    Raises:
        InvalidInput: a missing or malformed mesh, a rotation that is none, a polygon that is not
            planar or crosses itself, no triangle at all.
    """

    def __init__(self, entry: EnvironmentEntry) -> None:
        field = "environment"
        pieces = [_mesh(m, f"{field}.meshes.{k}") for k, m in enumerate(entry.meshes)]
        pieces += [_polygon(s, f"{field}.surfaces.{k}") for k, s in enumerate(entry.surfaces)]
        triangles = np.concatenate([np.zeros((0, 3, 3)), *pieces])
        declared = [_friction(mesh) for mesh in entry.meshes]
        declared += [_friction(surface) for surface in entry.surfaces]
        friction = np.repeat(declared, [len(piece) for piece in pieces])
        doubled = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        areas = np.linalg.norm(doubled, axis=1) / 2
        kept = areas > MIN_AREA
        self.triangles: Triangles = triangles[kept]
        self.normals: NDArray[np.float64] = doubled[kept] / (2 * areas[kept, None])
        self.friction: NDArray[np.float64] = friction[kept]
        if not len(self.triangles):
            raise InvalidInput(field, entry.name, "has neither a mesh nor a surface")
        self.bvh = _bvh(self.triangles)
        self.bodies = _bodies(self.triangles)
        self._body_corners = [by_corner(self.triangles[body]) for body in self.bodies]
        self._low, self._high = self.triangles.min(axis=1), self.triangles.max(axis=1)
        self.body_points = np.array([self.triangles[body[0], 0] for body in self.bodies])
        self._body_low = np.array([self._low[body].min(axis=0) for body in self.bodies])
        self._body_high = np.array([self._high[body].max(axis=0) for body in self.bodies])

    def near(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.intp]:
        """Triangles whose bounding box meets the one from low (3,) to high (3,), metres."""
        return np.flatnonzero(((self._low <= high) & (self._high >= low)).all(axis=1))

    def distances(
        self, point: NDArray[np.float64], radius: float
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Triangles within a radius of a point (3,), and their distances; metres."""
        candidates = self.near(point - radius, point + radius)
        distances = triangle_distances(self.triangles[candidates], point)
        within = distances <= radius
        return candidates[within], distances[within]

    def distance(self, point: NDArray[np.float64]) -> float:
        """Distance of a point (3,) to the nearest triangle, metres."""
        return float(self.distances(point, np.inf)[1].min())

    def contains(self, point: NDArray[np.float64]) -> bool:
        """Whether a point (3,) is inside one of the pieces.

        The winding number of a closed piece is 1 inside and 0 outside. A piece without its bottom
        face, of which these meshes have many, still gives more than a half inside. The bounding
        box may rule pieces out for open pieces too: from outside its convex hull a piece fills less
        than half of the sphere of directions.
        """
        around = ((self._body_low <= point) & (point <= self._body_high)).all(axis=1)
        return any(
            winding_number(self._body_corners[k], point) > INSIDE for k in np.flatnonzero(around)
        )


def triangle_distances(triangles: Triangles, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances (n,) of a point (3,) to triangles, metres."""
    if not len(triangles):
        return np.zeros(0)
    targets = np.broadcast_to(point, (len(triangles), 3))
    # Typed as a library without stubs, since this function of trimesh has no annotations.
    closest_point: Any = trimesh.triangles.closest_point
    closest = closest_point(triangles, targets)
    return np.asarray(np.linalg.norm(closest - point, axis=1), dtype=float)


def point_distances(
    triangle: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distances (n,) of points (n, 3) to a triangle (3, 3), metres."""
    triangles = np.broadcast_to(triangle, (len(points), 3, 3))
    closest_point: Any = trimesh.triangles.closest_point
    closest = closest_point(triangles, points)
    return np.asarray(np.linalg.norm(closest - points, axis=1), dtype=float)


def by_corner(triangles: Triangles) -> NDArray[np.float64]:
    """Triangles (n, 3, 3) as contiguous (corner, axis, n), the order for `winding_number`."""
    return np.ascontiguousarray(triangles.transpose(1, 2, 0))


def winding_number(corners: NDArray[np.float64], point: NDArray[np.float64]) -> float:
    """Generalised winding number of triangles, from `by_corner`, about a point (3,).

    Sources: Jacobson, Kavan, Sorkine-Hornung, "Robust inside-outside segmentation using generalized
    winding numbers", 2013; Van Oosterom and Strackee, "The solid angle of a plane triangle", 1983.
    """
    a, b, c = arms = corners - point[:, None]
    la, lb, lc = np.sqrt(np.einsum("ijk,ijk->ik", arms, arms))
    ab, bc, ca = (np.einsum("ij,ij->j", u, v) for u, v in ((a, b), (b, c), (c, a)))
    # Written out: this is the inner loop of the check, and np.cross takes most of its time.
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    half_angles = np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return float(half_angles.sum() / (2 * np.pi))


def contact_on_environment(
    environment: Environment, contact: ContactEntry, index: int
) -> Iterator[Violation]:
    """Points of a contact off the environment, or whose normal is that of no facet there.

    Every triangle within the bound of the distance counts as a facet there.
    """
    farthest, widest = 0.0, 0.0
    for point in np.array(contact.points).reshape(-1, 3):
        facets, _ = environment.distances(point, CONTACT_BOUND)
        if len(facets):
            angles = [angle_between(n, contact.normal) for n in environment.normals[facets]]
            widest = max(widest, min(angles))
        else:
            farthest = max(farthest, environment.distance(point))
    if farthest > CONTACT_BOUND:
        text = f"contact point {1e3 * farthest:.1f} mm from the environment"
        text += f" (at most {1e3 * CONTACT_BOUND:.1f} mm)"
        yield Violation(index, contact.limb, Kind.OFF_ENVIRONMENT, text)
    if widest > NORMAL_BOUND:
        text = f"contact normal {np.rad2deg(widest):.2f} deg from that of any facet there"
        text += f" (at most {np.rad2deg(NORMAL_BOUND):.2f} deg)"
        yield Violation(index, contact.limb, Kind.NORMAL, text)


def contact_friction(
    environment: Environment, contact: ContactEntry, index: int
) -> Iterator[Violation]:
    """A contact with more friction than the environment declares where it lies.

    Of several facets within the bound of the distance the roughest counts.
    """
    for point in np.array(contact.points).reshape(-1, 3):
        facets, _ = environment.distances(point, CONTACT_BOUND)
        most = environment.friction[facets].max(initial=0.0)
        if len(facets) and contact.friction > most + FRICTION_SLACK:
            text = f"contact's friction {contact.friction:g}, the environment's there {most:g}"
            yield Violation(index, contact.limb, Kind.FRICTION, text)
            return


def mesh_triangles(bvh: Any) -> Triangles:
    """Triangles of a coal mesh, in its own frame."""
    faces = [[bvh.tri_indices(k)[c] for c in range(3)] for k in range(bvh.num_tris)]
    vertices = np.array(bvh.vertices(), dtype=float)
    return np.asarray(vertices[np.array(faces, dtype=int).reshape(-1, 3)], dtype=float)


def _friction(entry: MeshEntry | SurfaceEntry) -> float:
    return entry.friction if "friction" in entry.model_fields_set else np.inf


def _mesh(entry: MeshEntry, field: str) -> Triangles:
    rotation = np.array(entry.rotation, dtype=float)
    proper = (
        np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) and np.linalg.det(rotation) > 0
    )
    if not proper:
        raise InvalidInput(f"{field}.rotation", entry.rotation, "is no rotation matrix")
    path = find_resource(entry.file, f"{field}.file")
    try:
        loaded = coal.MeshLoader().load(str(path), np.ones(3))
    except (ValueError, RuntimeError) as error:
        raise InvalidInput(f"{field}.file", entry.file, f"cannot be loaded: {error}") from error
    moved = mesh_triangles(loaded) @ rotation.T + np.array(entry.translation, dtype=float)
    return np.asarray(moved, dtype=float)


def _polygon(entry: SurfaceEntry, field: str) -> Triangles:
    """Triangles of a polygon with holes, which need not be convex."""
    vertices = np.array(entry.vertices, dtype=float).reshape(-1, 3)
    if len(vertices) < 3:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "must have 3 vertices or more")
    origin = vertices.mean(axis=0)
    # The sum of cross products is twice the vector area, whatever the polygon's shape.
    area = np.cross(vertices - origin, np.roll(vertices - origin, -1, axis=0)).sum(axis=0)
    if np.linalg.norm(area) < MIN_AREA:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "has no area")
    normal = area / np.linalg.norm(area)
    seed = np.eye(3)[int(np.argmin(np.abs(normal)))]
    x = np.cross(seed, normal) / np.linalg.norm(np.cross(seed, normal))
    axes = np.array([x, np.cross(normal, x), normal])
    for k, hole in enumerate(entry.holes):
        if len(hole) < 3:
            raise InvalidInput(f"{field}.holes.{k}", hole, "has fewer than three points")
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


def _bvh(triangles: Triangles) -> Any:
    """Bounding volume hierarchy over triangles, which keep their order."""
    bvh = coal.BVHModelOBBRSS()
    bvh.beginModel(len(triangles), 3 * len(triangles))
    bvh.addVertices(triangles.reshape(-1, 3))
    bvh.addTriangles(np.arange(3 * len(triangles)).reshape(-1, 3))
    bvh.endModel()
    bvh.computeLocalAABB()
    return bvh


def vertex_bodies(triangles: Triangles) -> NDArray[np.intp]:
    """Number of the connected piece of every triangle (n,); pieces share no corner."""
    corners = np.round(triangles.reshape(-1, 3) / MERGE).astype(np.int64)
    _, vertex = np.unique(corners, axis=0, return_inverse=True)
    ends = vertex.reshape(-1, 3)
    rows, columns = ends[:, [0, 1]].ravel(), ends[:, [1, 2]].ravel()
    size = int(ends.max()) + 1
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1][ends[:, 0]])


def _bodies(triangles: Triangles) -> list[NDArray[np.intp]]:
    label = vertex_bodies(triangles)
    order = np.argsort(label, kind="stable")
    return list(np.split(order, np.flatnonzero(np.diff(label[order])) + 1))
