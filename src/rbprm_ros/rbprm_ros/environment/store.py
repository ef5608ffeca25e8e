"""What the node knows of the world: snapshots and changes, each a new version. No ROS here."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry, SurfaceEntry
from rbprm_core.scene import Classification, Scene, Surface, make_surface, surfaces_from_mesh
from rbprm_core.scene.convex import MAX_CORNERS, convex_polygons
from rbprm_core.scene.polygon import MIN_AREA
from rbprm_core.scene.triangles import fan_triangles
from rbprm_core.surface_kind import SurfaceKind
from rbprm_core.validation import MAX_FRICTION

Array = NDArray[np.float64]

CONTACT_KINDS = (SurfaceKind.SUPPORT, SurfaceKind.LEAN)

KnownSurface = tuple[SurfaceEntry, Surface]


class Limits(Protocol):
    """Most surfaces, obstacles, and triangles of all obstacles together; the node's `Settings`."""

    @property
    def max_surfaces(self) -> int: ...
    @property
    def max_obstacles(self) -> int: ...
    @property
    def max_triangles(self) -> int: ...


@dataclass(frozen=True, eq=False)
class Obstacle:
    """Triangles that the robot must not touch: an id, and (n, 3, 3) metres, planning frame."""

    id: str
    triangles: Array


@dataclass(frozen=True, eq=False)
class MeshUpdate:
    """A mesh to find contact surfaces in; what of it is none becomes an obstacle.

    Attributes:
        id: of the mesh and of its obstacle; its surfaces are called `id/…`, and stay the same where
            the mesh is the same.
        triangles: (n, 3, 3) metres, planning frame; the winding gives the outward normals.
        friction: of its surfaces. namespace: that it can be removed with.
    """

    id: str
    triangles: Array
    friction: float
    namespace: str = ""

    def same(self, other: MeshUpdate) -> bool:
        """Whether another mesh is this one."""
        return self.friction == other.friction and np.array_equal(self.triangles, other.triangles)


@dataclass(frozen=True)
class SurfaceUpdate:
    """A message about the environment; its polygons are not validated yet.

    Attributes:
        entries: polygons to set, metres, planning frame.
        is_diff: whether they change what is known, or replace it all.
        removed: ids of surfaces, obstacles or meshes to remove first; one that is not known is an
            error.
        stamp: when it was seen, nanoseconds of the ROS clock.
        obstacles: to set. meshes: to set, in place of what the mesh of that id was.
        removed_meshes: ids of meshes to remove first, those that are there.
        cleared: namespaces whose meshes are removed first; "" for all.
        classification: how normals decide what a surface is good for.
    """

    entries: tuple[SurfaceEntry, ...] = ()
    is_diff: bool = False
    removed: tuple[str, ...] = ()
    stamp: int = 0
    obstacles: tuple[Obstacle, ...] = ()
    meshes: tuple[MeshUpdate, ...] = ()
    removed_meshes: tuple[str, ...] = ()
    cleared: tuple[str, ...] = ()
    classification: Classification = field(default_factory=Classification)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The environment at one time: never changed, and plain data, so that it crosses processes.

    Attributes:
        version: counts the changes that were accepted; 0 before anything was. The same version is
            the same environment.
        stamp: of the newest message taken in, nanoseconds of the ROS clock.
        entry: the polygons as they were received. surfaces: the same, validated, in that order.
        obstacles: in the order in which they came.
    """

    version: int = 0
    stamp: int = 0
    entry: EnvironmentEntry = field(default_factory=EnvironmentEntry)
    surfaces: tuple[Surface, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()

    def scene(self) -> Scene:
        """A new scene of the obstacles and of the surfaces, which are obstacles as well.

        Raises:
            InvalidInput: there are none.
        """
        triangles = [obstacle.triangles for obstacle in self.obstacles]
        return Scene(self.surfaces, np.concatenate(triangles) if triangles else None)


@dataclass(frozen=True)
class FoundSurfaces:
    """What was found in a mesh, by which rule."""

    mesh: MeshUpdate
    rule: Classification
    surfaces: dict[str, KnownSurface]
    obstacle: Obstacle | None


@dataclass(frozen=True)
class _Known:
    """All that is known, by id; copied to be edited."""

    surfaces: dict[str, KnownSurface] = field(default_factory=dict)
    obstacles: dict[str, Obstacle] = field(default_factory=dict)
    meshes: dict[str, FoundSurfaces] = field(default_factory=dict)

    def copy(self) -> _Known:
        return _Known(dict(self.surfaces), dict(self.obstacles), dict(self.meshes))

    def remove(self, identity: str) -> bool:
        """Forget a surface, an obstacle, or a mesh with all that is left of it."""
        tables = (self.surfaces, self.obstacles, self.meshes)
        mesh = self.meshes.get(identity)
        found = [table.pop(identity, None) is not None for table in tables]
        for part in mesh.surfaces if mesh is not None else ():
            self.surfaces.pop(part, None)
        return any(found)

    def differs(self, other: _Known) -> bool:
        """Whether there is anything else, or in another order."""
        surfaces = list(self.surfaces.values()) != list(other.surfaces.values())
        return surfaces or list(self.obstacles.values()) != list(other.obstacles.values())


class Environment:
    """Takes updates in, whole or not at all."""

    def __init__(self) -> None:
        self.rejection = ""
        """Why the newest update was refused; "" where it was accepted."""
        self._snapshot = Snapshot()
        self._known = _Known()

    @property
    def snapshot(self) -> Snapshot:
        """The environment as it is now."""
        return self._snapshot

    @property
    def version(self) -> int:
        """Counts the changes; where it is the same after an update, nothing has changed."""
        return self._snapshot.version

    def clear(self) -> None:
        """Forget everything; the version goes on, so that none comes twice."""
        self.rejection = ""
        self._known = _Known()
        if self.version:
            self._snapshot = Snapshot(version=self.version + 1)

    def unsearched(self, update: SurfaceUpdate) -> tuple[MeshUpdate, ...]:
        """The meshes of an update that are not known, or were searched by another rule."""
        return tuple(
            mesh
            for mesh in update.meshes
            if not _is_of(self._known.meshes.get(mesh.id), mesh, update.classification)
        )

    def update(
        self, update: SurfaceUpdate, limits: Limits, found: Iterable[FoundSurfaces] = ()
    ) -> Snapshot:
        """Take an update in; the version stays where it changes nothing.

        Args:
            limits: most that there may be afterwards.
            found: what was found in meshes of the update; the others are searched now.

        Raises:
            InvalidInput: names the field of the message; the environment stays as it was.
        """
        try:
            _require_ids(update)
            _require_room("surfaces", len(update.entries), limits.max_surfaces)
            known = _edited(self._known, update, {each.mesh.id: each for each in found})
            triangles = sum(len(obstacle.triangles) for obstacle in known.obstacles.values())
            _require_room("surfaces", len(known.surfaces), limits.max_surfaces)
            _require_room("obstacles", len(known.obstacles), limits.max_obstacles)
            _require_room("obstacles", triangles, limits.max_triangles, "triangles")
        except InvalidInput as error:
            self.rejection = str(error)
            raise
        self.rejection = ""
        changed = self._snapshot.version == 0 or known.differs(self._known)
        self._known = known
        if changed:
            self._snapshot = Snapshot(
                version=self._snapshot.version + 1,
                stamp=update.stamp,
                entry=EnvironmentEntry(surfaces=tuple(e for e, _ in known.surfaces.values())),
                surfaces=tuple(surface for _, surface in known.surfaces.values()),
                obstacles=tuple(known.obstacles.values()),
            )
        else:
            self._snapshot = dataclasses.replace(self._snapshot, stamp=update.stamp)
        return self._snapshot


def _edited(before: _Known, update: SurfaceUpdate, found: Mapping[str, FoundSurfaces]) -> _Known:
    known = before.copy() if update.is_diff else _Known()
    _remove(known, update)
    for mesh in update.meshes:
        _set_mesh(known, before, mesh, update.classification, found.get(mesh.id))
    known.surfaces.update(_surfaces(update, before))
    for obstacle in update.obstacles:
        old = before.obstacles.get(obstacle.id)
        same = old is not None and np.array_equal(old.triangles, obstacle.triangles)
        known.obstacles[obstacle.id] = old if old is not None and same else obstacle
    for identity in sorted(known.surfaces.keys() & known.obstacles.keys()):
        raise InvalidInput("obstacles", identity, "a surface has this id too: remove one of them")
    _classify(known, update.classification)
    return known


def _remove(known: _Known, update: SurfaceUpdate) -> None:
    """Forget what an update removes."""
    if update.removed and not update.is_diff:
        reason = "only a change (is_diff) removes; a snapshot replaces everything"
        raise InvalidInput("removed_ids", list(update.removed), reason)
    for i, identity in enumerate(update.removed):
        if not known.remove(identity):
            reason = "no surface or obstacle has this id"
            raise InvalidInput(f"removed_ids.{i}", identity, reason)
    cleared = set(update.cleared)
    for identity, found in list(known.meshes.items()):
        if identity in update.removed_meshes or cleared & {"", found.mesh.namespace}:
            known.remove(identity)


def _is_of(found: FoundSurfaces | None, mesh: MeshUpdate, rule: Classification) -> bool:
    """Whether something was found in a mesh by a rule."""
    return found is not None and found.rule == rule and found.mesh.same(mesh)


def _set_mesh(
    known: _Known,
    before: _Known,
    mesh: MeshUpdate,
    rule: Classification,
    found: FoundSurfaces | None,
) -> None:
    """Set what is found in a mesh; one that is known is not searched again."""
    old = before.meshes.get(mesh.id)
    if old is not None and _is_of(old, mesh, rule):
        found = old
    elif found is None:
        found = search(mesh, rule)
    if old is not None and old is not found:
        for part in old.surfaces.keys() - found.surfaces.keys():
            known.surfaces.pop(part, None)
    if found.obstacle is None:
        known.obstacles.pop(mesh.id, None)
    else:
        known.obstacles[mesh.id] = found.obstacle
    known.surfaces.update(found.surfaces)
    known.meshes[mesh.id] = found


def search(mesh: MeshUpdate, rule: Classification) -> FoundSurfaces:
    """Contact surfaces of a mesh, and the rest of it as one obstacle; 0.3 ms a surface."""
    surfaces: dict[str, KnownSurface] = {}
    rest: list[Array] = []
    for facet in surfaces_from_mesh(mesh.triangles, mesh.friction, rule):
        if facet.kind not in CONTACT_KINDS or facet.polygon.area <= MIN_AREA:
            rest += facet.polygon.pieces
            continue
        surface = dataclasses.replace(facet, id=f"{mesh.id}/{facet.id}")
        surfaces[surface.id] = (_entry(surface), surface)
    obstacle = Obstacle(mesh.id, fan_triangles(rest)) if rest else None
    return FoundSurfaces(mesh, rule, surfaces, obstacle)


def _entry(surface: Surface) -> SurfaceEntry:
    polygon = surface.polygon
    return SurfaceEntry(
        id=surface.id,
        vertices=tuple(polygon.boundary.tolist()),
        holes=tuple(tuple(hole.tolist()) for hole in polygon.holes),
        friction=surface.friction,
    )


def _surfaces(update: SurfaceUpdate, before: _Known) -> dict[str, KnownSurface]:
    """The surfaces of an update; one that is known stays itself, since perception repeats."""
    made: dict[str, KnownSurface] = {}
    fast = _convex(update, before)
    for i, entry in enumerate(update.entries):
        known, surface = before.surfaces.get(entry.id), fast.get(i)
        if known is not None and known[0] == entry:
            made[entry.id] = known
            continue
        if surface is None:  # concave, with holes, or wrong: then it says what
            rule, name = update.classification, f"surfaces.{i}"
            surface = make_surface(
                entry.id, entry.vertices, entry.friction, entry.holes, rule, name
            )
        made[entry.id] = (entry, surface)
    return made


def _convex(update: SurfaceUpdate, before: _Known) -> dict[int, Surface]:
    """The new surfaces that are convex, by place in the update, all of a size at once."""
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


def _classify(known: _Known, rule: Classification) -> None:
    """Give the surfaces that stay the kinds of today's rule; it may have changed."""
    for identity, (entry, surface) in known.surfaces.items():
        kind = rule.kind(surface.normal, surface.polygon.area)
        if kind is not surface.kind:
            known.surfaces[identity] = (entry, dataclasses.replace(surface, kind=kind))


def _require_ids(update: SurfaceUpdate) -> None:
    """Refuse ids that are empty or come twice; of a mesh none comes twice."""
    seen: dict[str, str] = {}
    lists: tuple[tuple[str, Sequence[SurfaceEntry | Obstacle]], ...] = (
        ("surfaces", update.entries),
        ("obstacles", update.obstacles),
    )
    for name, things in lists:
        for i, thing in enumerate(things):
            place = f"{name}.{i}"
            if not thing.id:
                raise InvalidInput(f"{place}.id", thing.id, "must not be empty")
            if thing.id in seen:
                raise InvalidInput(f"{place}.id", thing.id, f"{seen[thing.id]} has this id too")
            seen[thing.id] = place


def _require_room(name: str, count: int, most: int, what: str = "") -> None:
    if count > most:
        what = what or name
        reason = f"are too many; the parameter max_{what} is {most}"
        raise InvalidInput(name, f"{count} {what}", reason)
