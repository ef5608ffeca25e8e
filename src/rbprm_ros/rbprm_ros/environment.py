"""The surfaces that the node knows: snapshots and changes, each a new version. No ROS here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rbprm_core.errors import InvalidInput
from rbprm_core.plan import EnvironmentEntry, SurfaceEntry
from rbprm_core.scene import Scene, Surface, make_surface

Known = dict[str, tuple[SurfaceEntry, Surface]]


@dataclass(frozen=True)
class SurfaceUpdate:
    """A message with surfaces, not yet validated.

    Attributes:
        entries: polygons to set, metres, planning frame.
        is_diff: whether they change the known surfaces, or replace them all.
        removed: ids to remove first.
        stamp: when the surfaces were seen, nanoseconds of the ROS clock.
    """

    entries: tuple[SurfaceEntry, ...]
    is_diff: bool = False
    removed: tuple[str, ...] = ()
    stamp: int = 0


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The surfaces at one time: never changed, and plain data, so that it crosses processes.

    Attributes:
        version: counts what was accepted; 0 before anything was.
        stamp: of the newest message taken in, nanoseconds of the ROS clock.
        entry: the polygons as they were received. surfaces: the same, validated, in that order.
    """

    version: int = 0
    stamp: int = 0
    entry: EnvironmentEntry = field(default_factory=EnvironmentEntry)
    surfaces: tuple[Surface, ...] = ()

    def scene(self) -> Scene:
        """A new scene of these surfaces, which are obstacles as well.

        Raises:
            InvalidInput: there are none.
        """
        return Scene(self.surfaces)


class Environment:
    """Takes updates in, whole or not at all."""

    def __init__(self) -> None:
        self.rejection = ""
        """Why the newest update was refused; "" where it was accepted."""
        self._snapshot = Snapshot()
        self._known: Known = {}

    @property
    def snapshot(self) -> Snapshot:
        """The surfaces as they are now."""
        return self._snapshot

    def update(self, update: SurfaceUpdate, max_surfaces: int) -> Snapshot:
        """Take an update in; the version stays where it changes nothing.

        Args:
            max_surfaces: most surfaces that there may be afterwards.

        Raises:
            InvalidInput: names the field of the message; the surfaces stay as they were.
        """
        try:
            known = self._edited(update, max_surfaces)
        except InvalidInput as error:
            self.rejection = str(error)
            raise
        self.rejection = ""
        changed = list(known.values()) != list(self._known.values()) or self._snapshot.version == 0
        self._known = known
        self._snapshot = Snapshot(
            version=self._snapshot.version + changed,
            stamp=update.stamp,
            entry=EnvironmentEntry(surfaces=tuple(entry for entry, _ in known.values())),
            surfaces=tuple(surface for _, surface in known.values()),
        )
        return self._snapshot

    def _edited(self, update: SurfaceUpdate, max_surfaces: int) -> Known:
        known = dict(self._known) if update.is_diff else {}
        if update.removed and not update.is_diff:
            reason = "only a change (is_diff) removes; a snapshot replaces everything"
            raise InvalidInput("removed_ids", list(update.removed), reason)
        for i, identity in enumerate(update.removed):
            if known.pop(identity, None) is None:
                raise InvalidInput(f"removed_ids.{i}", identity, "no surface has this id")
        _require_unique(update.entries)
        _require_room(known, update.entries, max_surfaces)
        for i, entry in enumerate(update.entries):
            known[entry.id] = self._surface(entry, f"surfaces.{i}")
        return known

    def _surface(self, entry: SurfaceEntry, name: str) -> tuple[SurfaceEntry, Surface]:
        """The surface of an entry; one that is known stays itself, since perception repeats."""
        known = self._known.get(entry.id)
        if known is not None and known[0] == entry:
            return known
        surface = make_surface(entry.id, entry.vertices, entry.friction, entry.holes, field=name)
        return entry, surface


def _require_unique(entries: Sequence[SurfaceEntry]) -> None:
    seen: dict[str, int] = {}
    for i, entry in enumerate(entries):
        if not entry.id:
            raise InvalidInput(f"surfaces.{i}.id", entry.id, "must not be empty")
        if entry.id in seen:
            reason = f"surface {seen[entry.id]} of the message has this id too"
            raise InvalidInput(f"surfaces.{i}.id", entry.id, reason)
        seen[entry.id] = i


def _require_room(known: Known, entries: Sequence[SurfaceEntry], most: int) -> None:
    count = len(known) + sum(entry.id not in known for entry in entries)
    if count > most:
        reason = f"are too many; the parameter max_surfaces is {most}"
        raise InvalidInput("surfaces", f"{count} surfaces", reason)
