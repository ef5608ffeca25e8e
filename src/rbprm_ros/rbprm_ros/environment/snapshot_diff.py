"""A snapshot by what differs from another one: a process that has that is sent no more."""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.plan_record import EnvironmentEntry
from rbprm_ros.environment.store import KnownSurface, Obstacle, Snapshot


@dataclass(frozen=True, eq=False)
class SnapshotChange:
    """How one snapshot follows from another.

    Attributes:
        version, stamp: of the later one.
        surfaces, obstacles: in the later one's order, each as its place in the earlier one, or
            itself where it is new.
    """

    version: int
    stamp: int
    surfaces: tuple[int | KnownSurface, ...]
    obstacles: tuple[int | Obstacle, ...]


def change_between(before: Snapshot, after: Snapshot) -> SnapshotChange:
    """What is to be done to a snapshot to get another; what is the same object stays."""
    surfaces = {id(surface): i for i, surface in enumerate(before.surfaces)}
    obstacles = {id(obstacle): i for i, obstacle in enumerate(before.obstacles)}
    known = zip(after.entry.surfaces, after.surfaces, strict=True)
    return SnapshotChange(
        after.version,
        after.stamp,
        tuple(surfaces.get(id(surface), (entry, surface)) for entry, surface in known),
        tuple(obstacles.get(id(obstacle), obstacle) for obstacle in after.obstacles),
    )


def changed(before: Snapshot, change: SnapshotChange) -> Snapshot:
    """The snapshot that a change makes of another."""
    known = list(zip(before.entry.surfaces, before.surfaces, strict=True))
    surfaces = [known[item] if isinstance(item, int) else item for item in change.surfaces]
    return Snapshot(
        change.version,
        change.stamp,
        EnvironmentEntry(surfaces=tuple(entry for entry, _ in surfaces)),
        tuple(surface for _, surface in surfaces),
        tuple(
            before.obstacles[item] if isinstance(item, int) else item for item in change.obstacles
        ),
    )
