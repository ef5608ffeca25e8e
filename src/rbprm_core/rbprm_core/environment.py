"""Conversion between the environment entry of a plan or scenario and the scene of the planner."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rbprm_core.arrays import Array
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


def load_scene(entry: EnvironmentEntry, classification: Classification) -> Scene:
    """The scene of the meshes and polygons of an environment.

    Args:
        entry: the environment.
        classification: rules that assign a kind to each surface.

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


def environment_classification(entry: EnvironmentEntry) -> Classification:
    """The rules that assigned kinds to the surfaces of an environment; the defaults if not known.

    Args:
        entry: the environment.
    """
    recorded = entry.classification
    if recorded is None:
        return Classification()
    return Classification(recorded.support, recorded.lean, recorded.min_area)


def polygon_surfaces(
    entries: Sequence[SurfaceEntry], classification: Classification, field: str
) -> list[Surface]:
    """The contact surfaces of polygons.

    Args:
        entries: the polygons.
        classification: rules that assign a kind to each surface.
        field: name of the field that holds the polygons in its `surfaces`, for errors.

    Raises:
        InvalidInput: a polygon that cannot be used.
    """
    surfaces = []
    for i, entry in enumerate(entries):
        surface = make_surface(
            entry.id,
            entry.vertices,
            entry.friction,
            entry.holes,
            classification,
            f"{field}.surfaces.{i}",
        )
        surfaces.append(surface)
    return surfaces


def polygon_entry(scene: Scene, name: str) -> EnvironmentEntry:
    """The environment entry of a scene, with all surfaces as polygons.

    It is for scenes that have changed since they were read from files.

    Args:
        scene: the scene.
        name: name of the environment.
    """
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
    """The vertices (n, 3) of a ring as tuples."""
    return tuple((x, y, z) for x, y, z in ring.tolist())


def _source(mesh: MeshEntry, field: str) -> MeshSource:
    """The mesh of an entry, its placement validated."""
    rotation = np.array(mesh.rotation)
    with np.errstate(over="ignore", invalid="ignore"):  # huge values overflow and are refused
        skew = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if not skew <= 1e-6 or np.linalg.det(rotation) < 0:
        raise InvalidInput(f"{field}.rotation", mesh.rotation, "is not a rotation matrix")
    translation = coordinates(f"{field}.translation", mesh.translation, (3,))
    return MeshSource(mesh.file, translation, rotation, mesh.friction)
