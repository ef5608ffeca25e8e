"""Surfaces, obstacles and meshes by id, and how an update edits them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rbprm_core.errors import InvalidInput
from rbprm_core.scene import Classification, Surface, make_surface
from rbprm_core.scene.convex import MAX_CORNERS, convex_polygons
from rbprm_core.validation import MAX_FRICTION
from rbprm_ros.environment.mesh_search import FoundSurfaces, search_mesh
from rbprm_ros.environment.snapshot import KnownSurface, Obstacle
from rbprm_ros.environment.updates import MeshUpdate, SurfaceUpdate


@dataclass(frozen=True)
class Contents:
    """All that the environment holds.

    Attributes:
        surfaces: contact surfaces by id, those of meshes included.
        obstacles: obstacles by id, those of meshes included.
        meshes: meshes by id, with the surfaces found in them.
    """

    surfaces: dict[str, KnownSurface] = field(default_factory=dict)
    obstacles: dict[str, Obstacle] = field(default_factory=dict)
    meshes: dict[str, FoundSurfaces] = field(default_factory=dict)

    def copy(self) -> Contents:
        """A copy that can be edited."""
        return Contents(dict(self.surfaces), dict(self.obstacles), dict(self.meshes))

    def remove(self, identity: str) -> bool:
        """Remove a surface, an obstacle, or a mesh with its surfaces; False for an unknown id.

        Args:
            identity: id of the surface, obstacle or mesh.
        """
        tables = (self.surfaces, self.obstacles, self.meshes)
        mesh = self.meshes.get(identity)
        found = [table.pop(identity, None) is not None for table in tables]
        for part in mesh.surfaces if mesh is not None else ():
            self.surfaces.pop(part, None)
        return any(found)

    def differs(self, other: Contents) -> bool:
        """Whether surfaces or obstacles are others, or in another order.

        Args:
            other: the contents to compare with.
        """
        surfaces = list(self.surfaces.values()) != list(other.surfaces.values())
        return surfaces or list(self.obstacles.values()) != list(other.obstacles.values())


def edited(before: Contents, update: SurfaceUpdate, found: Mapping[str, FoundSurfaces]) -> Contents:
    """The contents after an update.

    Args:
        before: the contents before it, which stay unchanged.
        update: the update.
        found: surfaces found in meshes of the update, by mesh id; other meshes are searched now.

    Raises:
        InvalidInput: names the field of the message.
    """
    after = before.copy() if update.is_diff else Contents()
    _remove(after, update)
    for mesh in update.meshes:
        _set_mesh(after, before, mesh, update.classification, found.get(mesh.id))
    after.surfaces.update(_surfaces(update, before))
    for obstacle in update.obstacles:
        old = before.obstacles.get(obstacle.id)
        same = old is not None and np.array_equal(old.triangles, obstacle.triangles)
        after.obstacles[obstacle.id] = old if old is not None and same else obstacle
    for identity in sorted(after.surfaces.keys() & after.obstacles.keys()):
        raise InvalidInput("obstacles", identity, "a surface has this id too: remove one of them")
    _classify(after, update.classification)
    return after


def _remove(contents: Contents, update: SurfaceUpdate) -> None:
    """Remove what an update removes."""
    if update.removed and not update.is_diff:
        reason = "only a change (is_diff) removes; a snapshot replaces everything"
        raise InvalidInput("removed_ids", list(update.removed), reason)
    for i, identity in enumerate(update.removed):
        if not contents.remove(identity):
            reason = "no surface or obstacle has this id"
            raise InvalidInput(f"removed_ids.{i}", identity, reason)
    cleared = set(update.cleared)
    for identity, found in list(contents.meshes.items()):
        if identity in update.removed_meshes or cleared & {"", found.mesh.namespace}:
            contents.remove(identity)


def _set_mesh(
    after: Contents,
    before: Contents,
    mesh: MeshUpdate,
    rule: Classification,
    found: FoundSurfaces | None,
) -> None:
    """Set the surfaces and the obstacle of a mesh; a known mesh is not searched again."""
    old = before.meshes.get(mesh.id)
    if old is not None and old.is_result_for(mesh, rule):
        found = old
    elif found is None:
        found = search_mesh(mesh, rule)
    if old is not None and old is not found:
        for part in old.surfaces.keys() - found.surfaces.keys():
            after.surfaces.pop(part, None)
    if found.obstacle is None:
        after.obstacles.pop(mesh.id, None)
    else:
        after.obstacles[mesh.id] = found.obstacle
    after.surfaces.update(found.surfaces)
    after.meshes[mesh.id] = found


def _surfaces(update: SurfaceUpdate, before: Contents) -> dict[str, KnownSurface]:
    """The surfaces of an update by id.

    A surface that is known and unchanged stays the same object, since perception repeats itself.
    """
    made: dict[str, KnownSurface] = {}
    convex = _convex(update, before)
    for i, entry in enumerate(update.entries):
        known, surface = before.surfaces.get(entry.id), convex.get(i)
        if known is not None and known[0] == entry:
            made[entry.id] = known
            continue
        if surface is None:  # concave, with holes, or invalid, which `make_surface` then reports
            rule, name = update.classification, f"surfaces.{i}"
            surface = make_surface(
                entry.id, entry.vertices, entry.friction, entry.holes, rule, name
            )
        made[entry.id] = (entry, surface)
    return made


def _convex(update: SurfaceUpdate, before: Contents) -> dict[int, Surface]:
    """The new convex surfaces by index in the update; all with as many corners are made at once."""
    sizes: dict[int, list[int]] = {}
    for i, entry in enumerate(update.entries):
        known = before.surfaces.get(entry.id)
        is_new = known is None or known[0] != entry
        is_simple = len(entry.vertices) <= MAX_CORNERS and not entry.holes
        if is_new and is_simple and 0 <= entry.friction <= MAX_FRICTION:
            sizes.setdefault(len(entry.vertices), []).append(i)
    made: dict[int, Surface] = {}
    for places in sizes.values():
        rings = np.array([update.entries[i].vertices for i in places], dtype=float)
        for i, polygon in zip(places, convex_polygons(rings), strict=True):
            if polygon is not None:
                entry = update.entries[i]
                kind = update.classification.kind(polygon.plane.normal, polygon.area)
                made[i] = Surface(entry.id, polygon, entry.friction, kind)
    return made


def _classify(contents: Contents, rule: Classification) -> None:
    """Classify the surfaces that stay: the parameters of the rule may have changed."""
    for identity, (entry, surface) in contents.surfaces.items():
        kind = rule.kind(surface.normal, surface.polygon.area)
        if kind is not surface.kind:
            contents.surfaces[identity] = (entry, dataclasses.replace(surface, kind=kind))
