"""The environment of a plan as one mesh, in metres in the planning frame."""

from __future__ import annotations

import numpy as np
import shapely
import trimesh

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry, MeshEntry, SurfaceEntry, Vector3
from rbprm_core.resources import find_resource
from rbprm_core.view.mesh_operations import flat_mesh, frame_on, joined

PLANAR_TOLERANCE = 5e-3  # metres that a polygon's vertices may lie off its plane
MIN_AREA = 1e-12  # square metres; smaller polygons have no reliable normal


def load_environment_mesh(environment: EnvironmentEntry) -> trimesh.Trimesh:
    """Return all triangles of an environment as one mesh, which is empty if there are none.

    Args:
        environment: environment of the plan; the mesh files that it names are read.

    Raises:
        InvalidInput: a file is missing or unreadable, or a surface is not a planar polygon.
    """
    meshes = [_placed(m, f"environment.meshes.{i}") for i, m in enumerate(environment.meshes)]
    surfaces = [
        _triangulated(s, f"environment.surfaces.{i}") for i, s in enumerate(environment.surfaces)
    ]
    return joined(meshes + surfaces)


def _placed(entry: MeshEntry, field: str) -> trimesh.Trimesh:
    """Return a mesh file at its pose in the planning frame."""
    path = find_resource(entry.file, f"{field}.file")
    try:
        mesh = trimesh.load_mesh(path)
    # trimesh's readers raise errors of many types
    except Exception as error:
        raise InvalidInput(f"{field}.file", entry.file, f"cannot be read: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or mesh.is_empty:
        raise InvalidInput(f"{field}.file", entry.file, "has no triangles")
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = entry.rotation, entry.translation
    return mesh.apply_transform(transform)


def _triangulated(entry: SurfaceEntry, field: str) -> trimesh.Trimesh:
    """Return a polygon with holes as triangles that face to its outside."""
    outline = np.array(entry.vertices).reshape(-1, 3)
    if len(outline) < 3:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "must have 3 vertices or more")
    normal = np.cross(outline, np.roll(outline, -1, axis=0)).sum(axis=0)  # Newell's method
    if np.linalg.norm(normal) < MIN_AREA:
        raise InvalidInput(f"{field}.vertices", entry.vertices, "has no area")
    frame = frame_on(outline[0], normal / np.linalg.norm(normal))

    def flat(loop: tuple[Vector3, ...]) -> Array:
        points: Array = trimesh.transform_points(np.array(loop), np.linalg.inv(frame))
        if np.abs(points[:, 2]).max() > PLANAR_TOLERANCE:
            raise InvalidInput(field, entry.id, f"is not planar within {PLANAR_TOLERANCE:g} m")
        return points[:, :2]

    polygon = shapely.Polygon(flat(entry.vertices), [flat(hole) for hole in entry.holes])
    if not polygon.is_valid:
        reason = f"is not a simple polygon: {shapely.is_valid_reason(polygon)}"
        raise InvalidInput(field, entry.id, reason)
    return flat_mesh(polygon).apply_transform(frame)
