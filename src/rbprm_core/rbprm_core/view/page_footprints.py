"""Footprints and their numbers as meshes for the page, in metres in the planning frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from shapely import MultiPolygon, Polygon

from rbprm_core.arrays import Array
from rbprm_core.view.footprints import Footprint
from rbprm_core.view.mesh_operations import flat_mesh, frame_on, joined

DISC_RADIUS = 0.045  # metres, of the footprint of a point contact


def layers(marks: Sequence[Footprint]) -> list[int]:
    """Return the layer of each footprint: one above all earlier ones that it overlaps, from 0.

    Args:
        marks: footprints, ordered by state.
    """
    centers = np.array([mark.position for mark in marks]).reshape(-1, 3)
    radii = np.array([mark.radius or DISC_RADIUS for mark in marks])
    result = np.zeros(len(marks), dtype=int)
    for i in range(len(marks)):
        near = np.linalg.norm(centers[:i] - centers[i], axis=1) < radii[:i] + radii[i]
        result[i] = 1 + result[:i][near].max(initial=-1)
    return result.tolist()


def patch_mesh(mark: Footprint) -> trimesh.Trimesh:
    """Return a footprint as triangles: a disc for a point contact, the patch for a planar one.

    Args:
        mark: footprint.
    """
    if not len(mark.corners):
        turns = np.linspace(0, 2 * np.pi, 33)[:-1]
        circle = DISC_RADIUS * np.column_stack((np.cos(turns), np.sin(turns), np.zeros(len(turns))))
        rim = trimesh.transform_points(circle, frame_on(mark.position, mark.normal))
    else:
        rim = mark.corners
    return trimesh.Trimesh(rim, [[0, k, k + 1] for k in range(1, len(rim) - 1)])


def number_mesh(mark: Footprint, across: Array) -> trimesh.Trimesh:
    """Return the number of a footprint's state as triangles on the plane of the footprint.

    Args:
        mark: footprint.
        across: (3,) direction in which the number is read.
    """
    return _digits(str(mark.state)).apply_transform(frame_on(mark.position, mark.normal, across))


def _digits(text: str) -> trimesh.Trimesh:
    """Return a text as triangles in the plane z = 0, centred, in a size that fits the disc."""
    size = DISC_RADIUS * (1.15 if len(text) < 3 else 0.85)
    path = TextPath(
        (0, 0), text, size=100, prop=FontProperties(family="DejaVu Sans", weight="bold")
    )
    # overlapping loops cancel, as the hole of a zero does
    shape = MultiPolygon()
    for loop in path.to_polygons():
        shape = shape.symmetric_difference(Polygon(loop))
    pieces = [shape] if isinstance(shape, Polygon) else list(shape.geoms)
    mesh = joined([flat_mesh(piece) for piece in pieces])
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh.apply_transform(np.diag([size / 100, size / 100, 1, 1]))
