"""From the environment that a plan or scenario names to the scene that is planned in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry, MeshEntry, SurfaceEntry, Vector3
from rbprm_core.scene import (
    Classification,
    MeshSource,
    Scene,
    Surface,
    make_surface,
    read_triangles,
    surfaces_from_mesh,
)
from rbprm_core.validation import coordinates

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
        found = surfaces_from_mesh(triangles, source.friction, classification)
        surfaces += [surface for surface in found if surface.id not in known]
    surfaces += polygon_surfaces(entry.surfaces, classification, "environment")
    return Scene(surfaces)


def polygon_surfaces(
    texts: Sequence[SurfaceEntry], classification: Classification, field: str
) -> list[Surface]:
    """Surfaces of polygons that are given directly.

    Args:
        field: that has them as its `surfaces`, in errors.

    Raises:
        InvalidInput: a polygon that cannot be used.
    """
    surfaces = []
    for i, text in enumerate(texts):
        place = f"{field}.surfaces.{i}"
        surfaces.append(
            make_surface(text.id, text.vertices, text.friction, text.holes, classification, place)
        )
    return surfaces


def polygon_entry(scene: Scene, name: str) -> EnvironmentEntry:
    """The surfaces of a scene in the words of the plan file, all as polygons: for a scene that no
    file has any more."""
    surfaces = tuple(
        SurfaceEntry(
            id=surface.id,
            vertices=_points(surface.polygon.boundary),
            holes=tuple(_points(hole) for hole in surface.polygon.holes),
            friction=surface.friction,
        )
        for surface in scene.surfaces
    )
    return EnvironmentEntry(name=name, surfaces=surfaces)


def _points(ring: Array) -> tuple[Vector3, ...]:
    return tuple((x, y, z) for x, y, z in ring.tolist())


def _source(mesh: MeshEntry, field: str) -> MeshSource:
    rotation = np.array(mesh.rotation)
    with np.errstate(over="ignore", invalid="ignore"):  # of huge values: then it is none
        skew = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if not skew <= 1e-6 or np.linalg.det(rotation) < 0:
        raise InvalidInput(f"{field}.rotation", mesh.rotation, "is not a rotation matrix")
    translation = coordinates(f"{field}.translation", mesh.translation, (3,))
    return MeshSource(mesh.file, translation, rotation, mesh.friction)
