"""Environment meshes: files to triangles, triangles to contact surfaces."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
import trimesh
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.resources import find_resource
from rbprm_core.scene.plane import Plane, plane_of
from rbprm_core.scene.polygon import PLANAR_TOLERANCE, Polygon, polygon_of_shape
from rbprm_core.scene.surface import Classification, Surface
from rbprm_core.validation import MAX_COORDINATE

Array = NDArray[np.float64]

ID_GRID = 1e-4  # metres; geometry that agrees to this gets the same id
SOME_DIRECTION = np.array([0.48, 0.36, 0.8])  # along no face that people draw
SEAM = 1e-6  # metres; vertices closer than this are one


@dataclass(frozen=True, eq=False)
class MeshSource:
    """A mesh file and where it stands.

    Attributes:
        file: relative to a `share` folder, or absolute.
        translation: (3,) metres. rotation: (3, 3). friction: of all its surfaces.
    """

    file: str
    translation: Array
    rotation: Array
    friction: float = 0.5


def read_triangles(source: MeshSource, field: str = "mesh") -> Array:
    """Triangles (n, 3, 3) of a mesh file in the planning frame, metres.

    Raises:
        InvalidInput: absent, truncated, no mesh, empty, or not finite.
    """
    path = find_resource(source.file, f"{field}.file")
    try:
        with np.errstate(invalid="ignore"):  # what is not finite is refused below
            mesh = trimesh.load_mesh(str(path), process=False)
        triangles = np.asarray(mesh.triangles, dtype=float)
    except Exception as error:  # the readers of the many formats raise what they like
        cause = f"{type(error).__name__}: {error}"
        reason = f"cannot be read as a mesh, it may be truncated or of another format: {cause}"
        raise InvalidInput(f"{field}.file", source.file, reason) from error
    if len(triangles) == 0:
        raise InvalidInput(f"{field}.file", source.file, "has no triangles")
    if path.suffix.lower() == ".off" and len(triangles) < _faces_of_off(path):
        # The reader takes what is left of a file that was cut short.
        raise InvalidInput(f"{field}.file", source.file, "is truncated: faces are missing")
    if not np.isfinite(triangles).all():
        raise InvalidInput(f"{field}.file", source.file, "has coordinates that are not finite")
    if np.abs(triangles).max() > MAX_COORDINATE:
        reason = f"has coordinates beyond {MAX_COORDINATE:g} m"
        raise InvalidInput(f"{field}.file", source.file, reason)
    return np.asarray(triangles @ source.rotation.T + source.translation)


def _faces_of_off(path: Path) -> int:
    """Number of faces that the header of an OFF file announces."""
    lines = (line.split("#")[0].split() for line in path.read_text().splitlines())
    words = [word for line in lines for word in line][:4]
    return int(words[2] if words[0].upper().endswith("OFF") else words[1])


def surfaces_of_mesh(
    triangles: Array, friction: float, classification: Classification
) -> list[Surface]:
    """Contact surfaces of a mesh: neighbouring coplanar facets merged, in a stable order.

    Args:
        triangles: (n, 3, 3); the winding gives the outward normals, whatever the file claims.

    Returns:
        Surfaces of every kind, sorted by id; the id depends on the surface's own geometry alone,
        so that editing one part of a mesh renames nothing elsewhere.
    """
    mesh = trimesh.Trimesh(*_indexed(triangles), process=False)
    mesh.update_faces(mesh.area_faces > 0)
    surfaces: dict[str, Surface] = {}
    for facet in _facets(mesh):
        for surface in _merge(mesh, facet, friction, classification):
            surfaces.setdefault(surface.id, surface)  # twice the same facet is one surface
    return [surfaces[identity] for identity in sorted(surfaces)]


def _facets(mesh: trimesh.Trimesh) -> Iterator[NDArray[np.int_]]:
    """Indices of the faces of each planar region, neighbours with a common normal.

    The two sides of a thin plate share edges and planes, so each half of all directions is
    grouped by itself.
    """
    front = mesh.face_normals @ SOME_DIRECTION > 0
    for side in (np.flatnonzero(front), np.flatnonzero(~front)):
        part = trimesh.Trimesh(mesh.vertices, mesh.faces[side], process=False)
        # Faces grouped edge by edge may bend from one end to the other: such a group is none.
        grouped = [np.asarray(facet, dtype=int) for facet in part.facets if _is_flat(part, facet)]
        alone = np.setdiff1d(np.arange(len(side)), np.concatenate([*grouped, [-1]]))
        yield from (side[facet] for facet in (*grouped, *alone[:, None].astype(int)))


def _is_flat(mesh: trimesh.Trimesh, facet: NDArray[np.int_]) -> bool:
    """True where all vertices of some faces lie in one plane."""
    plane = _plane(mesh, facet)
    corners = mesh.triangles[facet].reshape(-1, 3)
    return bool(np.abs((corners - plane.origin) @ plane.normal).max() < PLANAR_TOLERANCE / 2)


def _plane(mesh: trimesh.Trimesh, facet: NDArray[np.int_]) -> Plane:
    """The mean plane of some faces; its normal is rid of the rounding of single precision."""
    weights = mesh.area_faces[facet]
    normal = np.round(weights @ mesh.face_normals[facet] / weights.sum(), 6)
    normal /= np.linalg.norm(normal)
    return plane_of(weights @ mesh.triangles_center[facet] / weights.sum(), normal)


def _indexed(triangles: Array) -> tuple[Array, NDArray[np.int_]]:
    """Vertices and faces with vertices closer than the seam merged."""
    corners = triangles.reshape(-1, 3)
    _, first, inverse = np.unique(
        np.round(corners / SEAM).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    return corners[first], inverse.reshape(-1, 3)


def _merge(
    mesh: trimesh.Trimesh, facet: NDArray[np.int_], friction: float, rule: Classification
) -> list[Surface]:
    """The planar region of some neighbouring coplanar faces, in one or more polygons."""
    plane = _plane(mesh, facet)
    normal = plane.normal
    parts = [shapely.Polygon(plane.flatten(mesh.triangles[i])) for i in facet]
    region = shapely.unary_union(parts, grid_size=SEAM).simplify(
        2 * SEAM
    )  # snapping to the grid bends straight edges by as much
    shapes = region.geoms if isinstance(region, shapely.MultiPolygon) else [region]
    surfaces = []
    for shape in shapes:
        if shape.is_empty or not shape.is_valid or shape.area <= 0:
            continue
        polygon = polygon_of_shape(shapely.geometry.polygon.orient(shape), plane)
        kind = rule.kind(normal, polygon.area)
        identity = f"{kind}_{_digest(polygon)}"
        surfaces.append(Surface(identity, polygon, friction, kind))
    return surfaces


def _digest(polygon: Polygon) -> str:
    """Short name of a polygon's geometry, whichever vertex its rings start with."""
    corners = np.unique(np.vstack([polygon.boundary, *polygon.holes]), axis=0)
    grid = np.round(np.vstack([corners, polygon.plane.normal]) / ID_GRID).astype(np.int64)
    rows = grid[np.lexsort(grid.T)]
    return hashlib.blake2s(rows.tobytes(), digest_size=8).hexdigest()
