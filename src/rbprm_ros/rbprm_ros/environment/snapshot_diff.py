"""The difference between two snapshots: a process that holds the earlier one is sent no more."""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.plan_record import EnvironmentEntry
from rbprm_ros.environment.snapshot import KnownSurface, Obstacle, Snapshot


@dataclass(frozen=True, eq=False)
class SnapshotDiff:
    """The difference from an earlier snapshot to a later one.

    Attributes:
        version: version of the later snapshot.
        stamp: stamp of the later snapshot, nanoseconds of the ROS clock.
        surfaces: surfaces of the later snapshot, in its order, each as its index in the earlier one
            or, where it is new, as itself.
        obstacles: obstacles, likewise.
    """

    version: int
    stamp: int
    surfaces: tuple[int | KnownSurface, ...]
    obstacles: tuple[int | Obstacle, ...]


def diff_between(before: Snapshot, after: Snapshot) -> SnapshotDiff:
    """The difference between two snapshots; surfaces that are the same object are not new.

    Args:
        before: the earlier snapshot.
        after: the later snapshot.
    """
    surfaces = {id(surface): i for i, surface in enumerate(before.surfaces)}
    obstacles = {id(obstacle): i for i, obstacle in enumerate(before.obstacles)}
    known = zip(after.entry.surfaces, after.surfaces, strict=True)
    return SnapshotDiff(
        after.version,
        after.stamp,
        tuple(surfaces.get(id(surface), (entry, surface)) for entry, surface in known),
        tuple(obstacles.get(id(obstacle), obstacle) for obstacle in after.obstacles),
    )


def apply_diff(before: Snapshot, diff: SnapshotDiff) -> Snapshot:
    """The later snapshot, from the earlier one and the difference between them.

    Args:
        before: the earlier snapshot.
        diff: difference from it to the later one.
    """
    known = list(zip(before.entry.surfaces, before.surfaces, strict=True))
    surfaces = [known[item] if isinstance(item, int) else item for item in diff.surfaces]
    return Snapshot(
        diff.version,
        diff.stamp,
        EnvironmentEntry(surfaces=tuple(entry for entry, _ in surfaces)),
        tuple(surface for _, surface in surfaces),
        tuple(before.obstacles[item] if isinstance(item, int) else item for item in diff.obstacles),
    )
