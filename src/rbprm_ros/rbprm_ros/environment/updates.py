"""Updates of the environment, as the conversions make them from messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import SurfaceEntry
from rbprm_core.scene import Classification
from rbprm_ros.environment.snapshot import Obstacle


class Limits(Protocol):
    """Largest numbers of surfaces, obstacles, and triangles of all obstacles together.

    The node's `Settings` have them.
    """

    @property
    def max_surfaces(self) -> int: ...
    @property
    def max_obstacles(self) -> int: ...
    @property
    def max_triangles(self) -> int: ...


@dataclass(frozen=True, eq=False)
class MeshUpdate:
    """A mesh in which contact surfaces are searched; the rest of it becomes an obstacle.

    Attributes:
        id: name of the mesh and of its obstacle. Its surfaces are called `id/…`, and keep their
            names as long as the mesh stays the same.
        triangles: (n, 3, 3) corners of the triangles, metres, planning frame; the winding gives the
            outward normals.
        friction: coefficient of Coulomb friction of the surfaces.
        namespace: name of a group of meshes that can be removed together.
    """

    id: str
    triangles: Array
    friction: float
    namespace: str = ""

    def same(self, other: MeshUpdate) -> bool:
        """Whether another mesh has the same triangles and friction.

        Args:
            other: the mesh to compare with.
        """
        return self.friction == other.friction and np.array_equal(self.triangles, other.triangles)


@dataclass(frozen=True)
class SurfaceUpdate:
    """A message about the environment; its polygons are not validated yet.

    Attributes:
        entries: polygons to set, metres, planning frame.
        is_diff: True changes what is known, False replaces it all.
        removed: ids of surfaces, obstacles or meshes to remove first; an unknown id is an error.
        stamp: time of the message, nanoseconds of the ROS clock.
        obstacles: obstacles to set.
        meshes: meshes to set; each replaces the known mesh of its id.
        removed_meshes: ids of meshes to remove first; unknown ids are ignored.
        cleared: namespaces whose meshes are removed first; "" stands for all namespaces.
        classification: rule that decides from normal and area which contacts a surface is for.
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


def require_unique_ids(update: SurfaceUpdate) -> None:
    """Refuse an update with an empty id, or with one id twice.

    Args:
        update: the update.

    Raises:
        InvalidInput: names the field of the message. (Ids of meshes are unique by construction.)
    """
    seen: dict[str, str] = {}
    lists: tuple[tuple[str, Sequence[SurfaceEntry | Obstacle]], ...] = (
        ("surfaces", update.entries),
        ("obstacles", update.obstacles),
    )
    for name, items in lists:
        for i, item in enumerate(items):
            place = f"{name}.{i}"
            if not item.id:
                raise InvalidInput(f"{place}.id", item.id, "must not be empty")
            if item.id in seen:
                raise InvalidInput(f"{place}.id", item.id, f"{seen[item.id]} has this id too")
            seen[item.id] = place


def require_at_most(limit: int, count: int, field: str, counted: str = "") -> None:
    """Refuse more items than a parameter of the node allows.

    Args:
        limit: value of the parameter `max_…`.
        count: number of items.
        field: field of the message.
        counted: what is counted, as in the name of the parameter; "" for the field's name.

    Raises:
        InvalidInput: names the field and the parameter.
    """
    if count > limit:
        counted = counted or field
        reason = f"are too many; the parameter max_{counted} is {limit}"
        raise InvalidInput(field, f"{count} {counted}", reason)
