"""The environment that the node knows; updates are accepted whole or not at all."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry
from rbprm_ros.environment.contents import Contents, edited
from rbprm_ros.environment.mesh_search import FoundSurfaces
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.environment.updates import (
    Limits,
    MeshUpdate,
    SurfaceUpdate,
    require_at_most,
    require_unique_ids,
)


class Environment:
    """Surfaces and obstacles, changed by updates.

    Attributes:
        rejection: why the newest update was refused; "" where it was accepted.
    """

    def __init__(self) -> None:
        self.rejection = ""
        self._snapshot = Snapshot()
        self._contents = Contents()

    @property
    def snapshot(self) -> Snapshot:
        """The environment as it is now."""
        return self._snapshot

    @property
    def version(self) -> int:
        """Number of changes; an update that changes nothing does not count."""
        return self._snapshot.version

    def clear(self) -> None:
        """Remove everything; the version increases, so that no version comes twice."""
        self.rejection = ""
        self._contents = Contents()
        if self.version:
            self._snapshot = Snapshot(version=self.version + 1)

    def unsearched(self, update: SurfaceUpdate) -> tuple[MeshUpdate, ...]:
        """The meshes of an update that are unknown, or were searched by another rule.

        Args:
            update: the update.
        """
        found = self._contents.meshes
        return tuple(
            mesh
            for mesh in update.meshes
            if mesh.id not in found or not found[mesh.id].is_result_for(mesh, update.classification)
        )

    def update(
        self, update: SurfaceUpdate, limits: Limits, found: Iterable[FoundSurfaces] = ()
    ) -> Snapshot:
        """Accept an update and return the new snapshot.

        Args:
            update: the update.
            limits: largest numbers of surfaces, obstacles and triangles after it.
            found: surfaces found in meshes of the update; other meshes are searched now.

        Raises:
            InvalidInput: names the field of the message; the environment stays as it was.
        """
        try:
            contents = self._edited(update, limits, found)
        except InvalidInput as error:
            self.rejection = str(error)
            raise
        self.rejection = ""
        changed = self._snapshot.version == 0 or contents.differs(self._contents)
        self._contents = contents
        if changed:
            surfaces = contents.surfaces.values()
            self._snapshot = Snapshot(
                version=self._snapshot.version + 1,
                stamp=update.stamp,
                entry=EnvironmentEntry(surfaces=tuple(entry for entry, _ in surfaces)),
                surfaces=tuple(surface for _, surface in surfaces),
                obstacles=tuple(contents.obstacles.values()),
            )
        else:
            self._snapshot = dataclasses.replace(self._snapshot, stamp=update.stamp)
        return self._snapshot

    def _edited(
        self, update: SurfaceUpdate, limits: Limits, found: Iterable[FoundSurfaces]
    ) -> Contents:
        """The contents after an update.

        Raises:
            InvalidInput: names the field of the message.
        """
        require_unique_ids(update)
        require_at_most(limits.max_surfaces, len(update.entries), "surfaces")
        contents = edited(self._contents, update, {each.mesh.id: each for each in found})
        triangles = sum(len(obstacle.triangles) for obstacle in contents.obstacles.values())
        require_at_most(limits.max_surfaces, len(contents.surfaces), "surfaces")
        require_at_most(limits.max_obstacles, len(contents.obstacles), "obstacles")
        require_at_most(limits.max_triangles, triangles, "obstacles", "triangles")
        return contents
