"""Collision geometry of one link, with what depths need: its convex hull and an inscribed ball."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import coal
import numpy as np
import trimesh
from scipy.spatial import ConvexHull, QhullError

from rbprm_core.arrays import Array
from rbprm_core.check.triangle_geometry import (
    INSIDE,
    by_corner,
    component_labels,
    mesh_triangles,
    winding_number,
)
from rbprm_core.errors import InvalidInput


@dataclass(frozen=True)
class LinkGeometry:
    """One collision geometry of the robot; points are in its own frame, in metres.

    Attributes:
        link: name of the link in the URDF.
        frame: index of the link's frame in the pinocchio model.
        geometry: unsimplified geometry for coal.
    """

    link: str
    frame: int
    geometry: Any

    @cached_property
    def is_mesh(self) -> bool:
        """Whether the geometry is a mesh, which is a surface; other shapes are solid."""
        return isinstance(self.geometry, coal.BVHModelOBBRSS)

    @cached_property
    def triangles(self) -> Array:
        """Triangles (n, 3, 3) of a mesh."""
        return mesh_triangles(self.geometry)

    @cached_property
    def sample_points(self) -> Array:
        """One point (k, 3) of every connected component of the geometry."""
        if not self.is_mesh:
            return np.zeros((1, 3))
        _, first = np.unique(component_labels(self.triangles), return_index=True)
        return np.asarray(self.triangles[first, 0])

    def contains(self, point: Array) -> bool:
        """Return whether a point is inside a mesh, whichever way the mesh faces.

        Args:
            point: (3,) point, metres, in the frame of the geometry.
        """
        return abs(winding_number(self._corners, point)) > INSIDE  # mirrored meshes face inwards

    @cached_property
    def _corners(self) -> Array:
        return by_corner(self.triangles)

    @cached_property
    def convex(self) -> Any:
        """Convex coal shape for depths: the convex hull of a mesh, or the shape itself."""
        if not self.is_mesh:
            return self.geometry
        self.geometry.buildConvexHull(True, "Qt")
        return self.geometry.convex

    @cached_property
    def inscribed_ball(self) -> tuple[Array, float]:
        """Centre (3,) of the convex shape, and the radius of the largest ball about it inside.

        Raises:
            InvalidInput: the mesh is flat, or the shape is of a kind that URDF files do not have.
        """
        shape = self.geometry
        if isinstance(shape, coal.Sphere):
            return np.zeros(3), float(shape.radius)
        if isinstance(shape, coal.Cylinder | coal.Capsule):
            return np.zeros(3), float(min(shape.radius, shape.halfLength))
        if isinstance(shape, coal.Box):
            return np.zeros(3), float(np.min(shape.halfSide))
        if not self.is_mesh:
            raise InvalidInput("robot.urdf", self.link, f"has a {type(shape).__name__} geometry")
        try:
            planes = ConvexHull(np.array(shape.vertices())).equations
        except QhullError as error:
            raise InvalidInput("robot.urdf", self.link, "has a flat collision mesh") from error
        centre = np.array(trimesh.convex.convex_hull(np.array(shape.vertices())).center_mass)
        return centre, float(-(planes[:, :3] @ centre + planes[:, 3]).max())
