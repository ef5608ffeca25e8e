"""The scene: contact surfaces and obstacles, with arrays and coal meshes made from them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import coal
import numpy as np

from rbprm_core.arrays import Array, IntArray
from rbprm_core.errors import InvalidInput
from rbprm_core.scene.pieces import Pieces, pieces_of_kinds
from rbprm_core.scene.surface import Surface
from rbprm_core.scene.triangles import (
    component_labels,
    fan_triangles,
    mesh_shape,
    solid_angles,
    spatial_parts,
)
from rbprm_core.surface_kind import SurfaceKind

MIN_SHAPE_TRIANGLES = 8  # smaller coal meshes do not speed up collision queries
MAX_SHAPES = 16  # comparing more bounding boxes takes longer than it saves
ENCLOSED = 0.75  # winding number from which on a point is inside; an open part gives at most 0.5


class Scene:
    """Contact surfaces and obstacles in the planning frame; an edit makes a new scene.

    Args:
        surfaces: contact surfaces with unique ids.
        obstacles: (n, 3, 3) triangles of obstacles that are not contact surfaces, metres.

    Attributes:
        surfaces: all contact surfaces.
        index: index in `surfaces` of each surface, by its id.

    Raises:
        InvalidInput: two surfaces have the same id, or there are neither surfaces nor obstacles.
    """

    def __init__(self, surfaces: Iterable[Surface], obstacles: Array | None = None) -> None:
        self.surfaces = tuple(surfaces)
        self._obstacles = np.zeros((0, 3, 3)) if obstacles is None else obstacles
        self.index = {surface.id: i for i, surface in enumerate(self.surfaces)}
        self._pieces: dict[tuple[SurfaceKind, ...], Pieces] = {}
        self._meshes: dict[tuple[SurfaceKind, ...], coal.BVHModelOBBRSS | None] = {}
        if len(self.index) != len(self.surfaces):
            ids = [surface.id for surface in self.surfaces]
            duplicate = next(i for i in ids if ids.count(i) > 1)
            raise InvalidInput("surfaces", duplicate, "two surfaces have this id")
        if not self.surfaces and not len(self._obstacles):
            raise InvalidInput("environment", "empty", "has neither surfaces nor meshes")

    @property
    def obstacles(self) -> Array:
        """Triangles (n, 3, 3) of obstacles that are not contact surfaces, metres."""
        return self._obstacles

    def edited(self, changed: Iterable[Surface] = (), removed: Iterable[str] = ()) -> Scene:
        """Return the scene with some surfaces added, replaced or removed.

        Args:
            changed: surfaces to add, or to put in the place of those with the same id.
            removed: ids of surfaces to remove.

        Raises:
            InvalidInput: no surface has an id that is to be removed, or the scene gets empty.
        """
        kept = {surface.id: surface for surface in self.surfaces}
        for identity in removed:
            if kept.pop(identity, None) is None:
                raise InvalidInput("removed", identity, "no surface has this id")
        kept.update({surface.id: surface for surface in changed})
        return Scene(kept.values(), self._obstacles)

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Lowest and highest corners (s, 3) of the bounding boxes of the surfaces, metres."""
        outlines = [surface.polygon.boundary for surface in self.surfaces]
        if not outlines:
            return np.zeros((0, 3)), np.zeros((0, 3))
        ends = np.cumsum([0, *(len(outline) for outline in outlines[:-1])])
        points = np.concatenate(outlines)
        return np.minimum.reduceat(points, ends), np.maximum.reduceat(points, ends)

    @cached_property
    def triangles(self) -> Array:
        """Triangles (n, 3, 3) of all obstacles and surfaces, metres."""
        pieces = [piece for surface in self.surfaces for piece in surface.polygon.pieces]
        return np.concatenate([self._obstacles, fan_triangles(pieces)])

    @cached_property
    def shape(self) -> coal.BVHModelOBBRSS:
        """All obstacles and surfaces as one coal mesh."""
        return mesh_shape(self.triangles)

    @cached_property
    def shapes(self) -> tuple[coal.BVHModelOBBRSS, ...]:
        """All obstacles and surfaces as several coal meshes, each of neighbouring triangles."""
        count = max(MIN_SHAPE_TRIANGLES, -(-len(self.triangles) // MAX_SHAPES))
        return tuple(mesh_shape(part) for part in spatial_parts(self.triangles, count))

    def surfaces_shape(self, kinds: tuple[SurfaceKind, ...]) -> coal.BVHModelOBBRSS | None:
        """Return the surfaces of some kinds as one coal mesh, None if there is no such surface.

        Args:
            kinds: kinds of surfaces to include.
        """
        if kinds not in self._meshes:
            chosen = [p for s in self.surfaces if s.kind in kinds for p in s.polygon.pieces]
            self._meshes[kinds] = mesh_shape(fan_triangles(chosen)) if chosen else None
        return self._meshes[kinds]

    def pieces(self, kinds: tuple[SurfaceKind, ...]) -> Pieces:
        """Return the convex pieces of the surfaces of some kinds.

        Args:
            kinds: kinds of surfaces to include.
        """
        kept = self._pieces.get(kinds)
        if kept is not None:
            return kept
        return self._pieces.setdefault(kinds, pieces_of_kinds(self.surfaces, kinds))

    def encloses(self, point: Array) -> bool:
        """Return whether a point lies inside a closed part of the scene.

        Args:
            point: (3,) point, metres, planning frame.
        """
        winding = np.bincount(self._components, weights=solid_angles(self.triangles - point))
        # Around the point, a closed part has winding number 1 if it faces outwards and -1 if it
        # faces inwards, as the walls of a room do. An open part such as the ground has at most 0.5.
        return bool((winding > ENCLOSED).any())

    @cached_property
    def _components(self) -> IntArray:
        """Label (n,) of the connected component of each triangle."""
        return component_labels(self.triangles)
