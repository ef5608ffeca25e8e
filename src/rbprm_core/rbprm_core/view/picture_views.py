"""Parallel projections of the picture, and shaded meshes drawn in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from rbprm_core.arrays import Array
from rbprm_core.view.mesh_operations import sharp_edges
from rbprm_core.view.palette import GROUND, GROUND_EDGE

EDGE_AHEAD = 0.02  # metres by which edges count as nearer than they are
LIGHT = np.array([-0.35, 0.45, 0.82])  # direction of the light: right, up, towards the reader


@dataclass(frozen=True, eq=False)
class View:
    """A parallel projection.

    Attributes:
        axes: indices of the coordinates drawn to the right and up the page.
        to_reader: (3,) unit vector towards the reader, planning frame.
        flip: whether the second coordinate decreases up the page, so that nothing is mirrored.
    """

    axes: tuple[int, int]
    to_reader: Array
    flip: bool = False

    @property
    def labels(self) -> tuple[str, str]:
        """Labels of the two axes."""
        right, up = self.axes
        return f"{'xyz'[right]} [m]", f"{'xyz'[up]} [m]"

    @property
    def light(self) -> Array:
        """Unit vector (3,) towards the light, planning frame."""
        right, up = np.eye(3)[list(self.axes)]
        up = -up if self.flip else up
        direction: Array = LIGHT[0] * right + LIGHT[1] * up + LIGHT[2] * self.to_reader
        return direction / float(np.linalg.norm(direction))


def above_and_side(extent: Array) -> tuple[View, View]:
    """Return the views from above and from the side, the longer horizontal side across the page.

    Args:
        extent: (3,) size of what is shown along x, y and z, metres.
    """
    up = np.array([0, 0, 1.0])
    if extent[0] >= extent[1]:
        return View((0, 1), up), View((0, 2), np.array([0, -1.0, 0]))
    return View((1, 0), up, flip=True), View((1, 2), np.array([1.0, 0, 0]))


def _shades(mesh: trimesh.Trimesh, view: View, color: str) -> Array:
    """Return the colours (k, 3) of the triangles under the light of the view."""
    # a mesh may be inside out or open: the visible side is lit
    facing = np.where(mesh.face_normals @ view.to_reader < 0, -1.0, 1.0)
    bright = 0.5 + 0.58 * np.clip(facing * (mesh.face_normals @ view.light), 0, 1)
    shades: Array = bright[:, None] * np.array(to_rgb(color))
    return shades


def draw_mesh(axes: Axes, mesh: trimesh.Trimesh, view: View, color: str, order: float) -> None:
    """Draw shaded triangles, the farthest first.

    Args:
        axes: axes to draw on.
        mesh: mesh, metres, planning frame.
        view: projection.
        color: colour of the mesh.
        order: drawing order of matplotlib (zorder).
    """
    far_first = np.argsort(mesh.triangles_center @ view.to_reader)
    shades = np.clip(_shades(mesh, view, color), 0, 1)[far_first]
    flat = mesh.triangles[far_first][:, :, list(view.axes)]
    axes.add_collection(
        PolyCollection(flat, facecolors=shades, edgecolors=shades, linewidths=0.3, zorder=order)
    )


def draw_environment(axes: Axes, ground: trimesh.Trimesh, view: View) -> None:
    """Draw triangles and sharp edges of the environment, the farthest first.

    Args:
        axes: axes to draw on.
        ground: mesh of the environment, metres, planning frame.
        view: projection.
    """
    if ground.is_empty:
        return
    edges = sharp_edges(ground)
    depths = ground.triangles_center @ view.to_reader
    nearness = (depths - depths.min()) / max(np.ptp(depths), 1e-9)
    shades = _shades(ground, view, GROUND) * (0.9 + 0.16 * nearness)[:, None]
    outlines = np.vstack((shades.clip(0, 1), np.tile(to_rgb(GROUND_EDGE), (len(edges), 1))))
    flat = [*ground.triangles[:, :, list(view.axes)], *edges[:, :, list(view.axes)]]
    # an edge is drawn right after the triangles that it bounds
    depths = np.concatenate((depths, edges.mean(axis=1) @ view.to_reader + EDGE_AHEAD))
    far_first = np.argsort(depths)
    axes.add_collection(
        PolyCollection(
            [flat[i] for i in far_first],
            facecolors=outlines[far_first],
            edgecolors=outlines[far_first],
            linewidths=0.6,
            zorder=1,
        )
    )
