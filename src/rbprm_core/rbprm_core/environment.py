"""From the environment that a plan or scenario names to the scene that is planned in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.plan import EnvironmentEntry, MeshEntry
from rbprm_core.scene import (
    Classification,
    MeshSource,
    Scene,
    Surface,
    make_surface,
    read_triangles,
    surfaces_of_mesh,
)

Array = NDArray[np.float64]


def load_scene(entry: EnvironmentEntry, classification: Classification) -> Scene:
    """Read meshes and polygons into a scene.

    Raises:
        InvalidInput: a mesh or polygon that cannot be used, or an empty environment.
    """
    surfaces: list[Surface] = []
    for i, mesh in enumerate(entry.meshes):
        field = f"environment.meshes.{i}"
        source = _source(mesh, field)
        triangles = read_triangles(source, field)
        known = {surface.id for surface in surfaces}
        found = surfaces_of_mesh(triangles, source.friction, classification)
        surfaces += [surface for surface in found if surface.id not in known]
    for i, text in enumerate(entry.surfaces):
        field = f"environment.surfaces.{i}"
        surfaces.append(
            make_surface(text.id, text.vertices, text.friction, text.holes, classification, field)
        )
    return Scene(surfaces)


def _source(mesh: MeshEntry, field: str) -> MeshSource:
    rotation = np.array(mesh.rotation)
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-6 or np.linalg.det(rotation) < 0:
        raise InvalidInput(f"{field}.rotation", mesh.rotation, "is not a rotation matrix")
    return MeshSource(mesh.file, np.array(mesh.translation), rotation, mesh.friction)
