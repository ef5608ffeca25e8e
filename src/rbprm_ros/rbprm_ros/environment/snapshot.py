"""The environment at one time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.plan_record import EnvironmentEntry, SurfaceEntry
from rbprm_core.scene import Scene, Surface

KnownSurface = tuple[SurfaceEntry, Surface]
"""A surface as it was received, and validated."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A mesh that the robot must not touch.

    Attributes:
        id: unique name among surfaces and obstacles.
        triangles: (n, 3, 3) corners of the triangles, metres, planning frame.
    """

    id: str
    triangles: Array


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The environment at one time; never changed, and plain data that can be sent to a process.

    Attributes:
        version: number of accepted changes; 0 before the first. Two snapshots of one version hold
            the same environment.
        stamp: stamp of the newest accepted message, nanoseconds of the ROS clock.
        entry: the polygons as they were received.
        surfaces: the same polygons, validated, in the same order.
        obstacles: the obstacles, in the order in which they came.
    """

    version: int = 0
    stamp: int = 0
    entry: EnvironmentEntry = field(default_factory=EnvironmentEntry)
    surfaces: tuple[Surface, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()

    def scene(self) -> Scene:
        """A new scene of the obstacles and the surfaces, which are obstacles as well.

        Raises:
            InvalidInput: there are no surfaces and no obstacles.
        """
        triangles = [obstacle.triangles for obstacle in self.obstacles]
        return Scene(self.surfaces, np.concatenate(triangles) if triangles else None)
