"""The environment of a plan as triangles: mesh files and polygons. Metres, planning frame."""

from __future__ import annotations

import numpy as np
import shapely
import trimesh
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry, MeshEntry, SurfaceEntry, Vector3
from rbprm_core.resources import find_resource
from rbprm_core.view.meshes import flat_mesh, frame_on, joined

Array = NDArray[np.float64]

PLANARITY = 5e-3  # metres that a polygon's vertices may lie off its plane


def read_ground(environment: EnvironmentEntry) -> trimesh.Trimesh:
    """All triangles of an environment; an empty mesh if it has none.

    Raises:
        InvalidInput: a file is missing or unreadable, or a surface is no planar polygon.
    """
    meshes = [_placed(m, f"environment.meshes.{i}") for i, m in enumerate(environment.meshes)]
    surfaces = [
        _triangulated(s, f"environment.surfaces.{i}") for i, s in enumerate(environment.surfaces)
    ]
    return joined(meshes + surfaces)


def _placed(entry: MeshEntry, field: str) -> trimesh.Trimesh:
    path = find_resource(entry.file, f"{field}.file")
    try:
        mesh = trimesh.load_mesh(path)
    # each of trimesh's many readers fails in its own way on a file that it cannot use
    except Exception as error:
        raise InvalidInput(f"{field}.file", entry.file, f"cannot be read: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or mesh.is_empty:
        raise InvalidInput(f"{field}.file", entry.file, "holds no triangles")
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = entry.rotation, entry.translation
    return mesh.apply_transform(transform)


def _triangulated(entry: SurfaceEntry, field: str) -> trimesh.Trimesh:
    """Triangles of a polygon with holes, seen from its outside."""
    outline = np.array(entry.vertices).reshape(-1, 3)
    if len(outline) < 3:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "a polygon has 3 vertices or more")
    normal = np.cross(outline, np.roll(outline, -1, axis=0)).sum(axis=0)  # Newell's
    if np.linalg.norm(normal) < 1e-12:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "the polygon has no area")
    frame = frame_on(outline[0], normal / np.linalg.norm(normal))

    def flat(loop: tuple[Vector3, ...]) -> Array:
        points: Array = trimesh.transform_points(np.array(loop), np.linalg.inv(frame))
        if np.abs(points[:, 2]).max() > PLANARITY:
            raise InvalidInput(field, entry.id, f"is not planar within {PLANARITY:g} m")
        return points[:, :2]

    polygon = shapely.Polygon(flat(entry.vertices), [flat(hole) for hole in entry.holes])
    if not polygon.is_valid:
        raise InvalidInput(field, entry.id, f"is no polygon: {shapely.is_valid_reason(polygon)}")
    return flat_mesh(polygon).apply_transform(frame)
