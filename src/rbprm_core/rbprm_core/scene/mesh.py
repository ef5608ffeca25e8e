"""Meshes of environments: triangles from files, contact surfaces from triangles."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
import trimesh

from rbprm_core.arrays import Array, IntArray
from rbprm_core.errors import InvalidInput
from rbprm_core.resources import find_resource
from rbprm_core.scene.plane import Plane, plane_from_normal
from rbprm_core.scene.polygon import PLANAR_TOLERANCE, Polygon, polygon_from_shape
from rbprm_core.scene.surface import Classification, Surface
from rbprm_core.validation import MAX_COORDINATE

ID_GRID = 1e-4  # metres; geometry that agrees to this gets the same id
SIDE_DIRECTION = np.array([0.48, 0.36, 0.8])  # parallel to no face of usual meshes
MERGE_DISTANCE = 1e-6  # metres; vertices closer than this are one


@dataclass(frozen=True, eq=False)
class MeshSource:
    """A mesh file and its pose in the planning frame.

    Attributes:
        file: path of the file, absolute or relative to a `share` folder.
        translation: (3,) position of the mesh's origin, metres, planning frame.
        rotation: (3, 3) rotation from the mesh's frame to the planning frame.
        friction: coefficient of Coulomb friction of all its surfaces.
    """

    file: str
    translation: Array
    rotation: Array
    friction: float = 0.5


def read_triangles(source: MeshSource, field: str = "mesh") -> Array:
    """Return the triangles (n, 3, 3) of a mesh file, metres, planning frame.

    Args:
        source: mesh file and its pose.
        field: name of the mesh in errors.

    Raises:
        InvalidInput: the file is missing, truncated, empty or not a mesh, or it has coordinates
            that are not finite or too large.
    """
    path = find_resource(source.file, f"{field}.file")
    try:
        with np.errstate(invalid="ignore"):  # coordinates that are not finite are refused below
            mesh = trimesh.load_mesh(str(path), process=False)
        triangles = np.asarray(mesh.triangles, dtype=float)
    except Exception as error:  # the readers of the formats raise errors of many types
        cause = f"{type(error).__name__}: {error}"
        reason = f"cannot be read as a mesh, it may be truncated or of another format: {cause}"
        raise InvalidInput(f"{field}.file", source.file, reason) from error
    if len(triangles) == 0:
        raise InvalidInput(f"{field}.file", source.file, "has no triangles")
    if path.suffix.lower() == ".off" and len(triangles) < _faces_of_off(path):
        # The reader accepts a truncated file.
        raise InvalidInput(f"{field}.file", source.file, "is truncated: faces are missing")
    if not np.isfinite(triangles).all():
        raise InvalidInput(f"{field}.file", source.file, "has coordinates that are not finite")
    if np.abs(triangles).max() > MAX_COORDINATE:
        reason = f"has coordinates beyond {MAX_COORDINATE:g} m"
        raise InvalidInput(f"{field}.file", source.file, reason)
    return np.asarray(triangles @ source.rotation.T + source.translation)


def _faces_of_off(path: Path) -> int:
    """Return the number of faces that the header of an OFF file declares."""
    lines = (line.split("#")[0].split() for line in path.read_text().splitlines())
    words = [word for line in lines for word in line][:4]
    return int(words[2] if words[0].upper().endswith("OFF") else words[1])


def surfaces_from_mesh(
    triangles: Array, friction: float, classification: Classification
) -> list[Surface]:
    """Return the contact surfaces of a mesh: neighbouring coplanar triangles are merged.

    Args:
        triangles: (n, 3, 3) triangles, metres, planning frame; their winding gives the outward
            normals, and normals stored in the file are ignored.
        friction: coefficient of Coulomb friction of all surfaces.
        classification: rules that assign the kinds.

    Returns:
        Surfaces of every kind, sorted by id. An id depends on the geometry of its surface alone, so
        that editing one part of a mesh changes no id elsewhere.
    """
    mesh = trimesh.Trimesh(*_vertices_and_faces(triangles), process=False)
    mesh.update_faces(mesh.area_faces > 0)
    surfaces: dict[str, Surface] = {}
    for facet in _facets(mesh):
        for surface in _merge(mesh, facet, friction, classification):
            surfaces.setdefault(surface.id, surface)  # a facet given twice is one surface
    return [surfaces[identity] for identity in sorted(surfaces)]


def _facets(mesh: trimesh.Trimesh) -> Iterator[IntArray]:
    """Yield the indices of the faces of each planar region: neighbours with a common normal.

    The two sides of a thin plate share edges and planes. So faces are grouped separately by the
    side of `SIDE_DIRECTION` to which they face.
    """
    front = mesh.face_normals @ SIDE_DIRECTION > 0
    for side in (np.flatnonzero(front), np.flatnonzero(~front)):
        part = trimesh.Trimesh(mesh.vertices, mesh.faces[side], process=False)
        # Faces grouped edge by edge may bend from one end to the other: then they stay single.
        grouped = [np.asarray(facet, dtype=int) for facet in part.facets if _is_flat(part, facet)]
        alone = np.setdiff1d(np.arange(len(side)), np.concatenate([*grouped, [-1]]))
        yield from (side[facet] for facet in (*grouped, *alone[:, None].astype(int)))


def _is_flat(mesh: trimesh.Trimesh, facet: IntArray) -> bool:
    """Return whether all vertices of some faces lie in one plane."""
    plane = _plane(mesh, facet)
    corners = mesh.triangles[facet].reshape(-1, 3)
    return bool(np.abs((corners - plane.origin) @ plane.normal).max() < PLANAR_TOLERANCE / 2)


def _plane(mesh: trimesh.Trimesh, facet: IntArray) -> Plane:
    """Return the mean plane of some faces, its normal rounded since files have single precision."""
    weights = mesh.area_faces[facet]
    normal = np.round(weights @ mesh.face_normals[facet] / weights.sum(), 6)
    normal /= np.linalg.norm(normal)
    return plane_from_normal(weights @ mesh.triangles_center[facet] / weights.sum(), normal)


def _vertices_and_faces(triangles: Array) -> tuple[Array, IntArray]:
    """Return vertices (v, 3) and faces (n, 3), vertices on one grid point merged."""
    corners = triangles.reshape(-1, 3)
    grid = np.round(corners / MERGE_DISTANCE).astype(np.int64)
    _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return corners[first], inverse.reshape(-1, 3)


def _merge(
    mesh: trimesh.Trimesh, facet: IntArray, friction: float, rule: Classification
) -> list[Surface]:
    """Return the surfaces, mostly one, of the region that coplanar neighbouring faces cover."""
    plane = _plane(mesh, facet)
    normal = plane.normal
    parts = [shapely.Polygon(plane.flatten(mesh.triangles[i])) for i in facet]
    region = shapely.unary_union(parts, grid_size=MERGE_DISTANCE)
    region = region.simplify(2 * MERGE_DISTANCE)  # snapping to the grid bends edges by as much
    shapes = region.geoms if isinstance(region, shapely.MultiPolygon) else [region]
    surfaces = []
    for shape in shapes:
        if shape.is_empty or not shape.is_valid or shape.area <= 0:
            continue
        polygon = polygon_from_shape(shapely.geometry.polygon.orient(shape), plane)
        kind = rule.kind(normal, polygon.area)
        identity = f"{kind}_{_digest(polygon)}"
        surfaces.append(Surface(identity, polygon, friction, kind))
    return surfaces


def _digest(polygon: Polygon) -> str:
    """Return a digest of a polygon's geometry that does not depend on where its rings start."""
    corners = np.unique(np.vstack([polygon.boundary, *polygon.holes]), axis=0)
    grid = np.round(np.vstack([corners, polygon.plane.normal]) / ID_GRID).astype(np.int64)
    rows = grid[np.lexsort(grid.T)]
    return hashlib.blake2s(rows.tobytes(), digest_size=8).hexdigest()
