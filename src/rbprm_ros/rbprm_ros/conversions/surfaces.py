"""Conversion of surfaces and obstacles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from rbprm_msgs.msg import Obstacle as ObstacleMessage
from rbprm_msgs.msg import PolygonRing, SurfaceArray
from rbprm_msgs.msg import Surface as SurfaceMessage
from std_msgs.msg import Header

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry, SurfaceEntry
from rbprm_core.scene import Surface
from rbprm_ros.conversions.geometry import (
    Triple,
    nanoseconds_of,
    require_frame,
    triple,
    vector_message,
)
from rbprm_ros.conversions.meshes import mesh_message, require_triangles, triangles_of_mesh
from rbprm_ros.environment.snapshot import Obstacle, Snapshot
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.settings import Settings


def update_of_message(message: SurfaceArray, settings: Settings) -> SurfaceUpdate:
    """An update of the environment; its polygons are validated when it is accepted.

    Args:
        message: surfaces and obstacles.
        settings: parameters of the node.

    Raises:
        InvalidInput: another frame, an invalid stamp, or more than the parameters allow.
    """
    require_frame(message.header, settings.planning_frame, "header")
    if len(message.surfaces) > settings.max_surfaces:
        reason = f"are too many; the parameter max_surfaces is {settings.max_surfaces}"
        raise InvalidInput("surfaces", f"{len(message.surfaces)} surfaces", reason)
    for i, surface in enumerate(message.surfaces):
        count = len(surface.vertices) + sum(len(hole.vertices) for hole in surface.holes)
        if count > settings.max_vertices:
            reason = f"are too many; the parameter max_vertices is {settings.max_vertices}"
            raise InvalidInput(f"surfaces.{i}.vertices", f"{count} vertices", reason)
    return SurfaceUpdate(
        entries=tuple(_entry(surface) for surface in message.surfaces),
        is_diff=message.is_diff,
        removed=tuple(message.removed_ids),
        stamp=nanoseconds_of(message.header.stamp),
        obstacles=_obstacles(message.obstacles, settings),
        classification=settings.classification,
    )


def surfaces_message(surfaces: Iterable[Surface], header: Header) -> SurfaceArray:
    """A snapshot of surfaces, without obstacles.

    Args:
        surfaces: the surfaces.
        header: header in the planning frame.
    """
    return SurfaceArray(header=header, surfaces=[_message(surface) for surface in surfaces])


def environment_message(snapshot: Snapshot, header: Header) -> SurfaceArray:
    """The message of a snapshot: polygons as they were received, and obstacles.

    Args:
        snapshot: the environment.
        header: header in the planning frame.
    """
    return SurfaceArray(
        header=header,
        surfaces=[_entry_message(entry) for entry in snapshot.entry.surfaces],
        obstacles=[_obstacle_message(obstacle) for obstacle in snapshot.obstacles],
    )


def environment_entry(message: SurfaceArray) -> EnvironmentEntry:
    """The environment of a plan, for its check, from an answer of ~/get_environment.

    The triangles of obstacles become surfaces named "id/number", without friction, since no limb is
    to make contact with them.

    Args:
        message: surfaces and obstacles.

    Raises:
        InvalidInput: an obstacle without valid triangles.
    """
    obstacles = [
        SurfaceEntry(id=f"{obstacle.id}/{k}", vertices=_corners(triangle), friction=0.0)
        for i, obstacle in enumerate(message.obstacles)
        for k, triangle in enumerate(triangles_of_mesh(obstacle.mesh, f"obstacles.{i}.mesh"))
    ]
    surfaces = [_entry(surface) for surface in message.surfaces]
    return EnvironmentEntry(surfaces=(*surfaces, *obstacles))


def _corners(triangle: NDArray[np.float64]) -> tuple[Triple, ...]:
    return tuple((x, y, z) for x, y, z in triangle.tolist())


def _obstacles(messages: Sequence[ObstacleMessage], settings: Settings) -> tuple[Obstacle, ...]:
    if len(messages) > settings.max_obstacles:
        reason = f"are too many; the parameter max_obstacles is {settings.max_obstacles}"
        raise InvalidInput("obstacles", f"{len(messages)} obstacles", reason)
    count = sum(len(message.mesh.triangles) for message in messages)
    require_triangles("obstacles", count, settings)
    return tuple(
        Obstacle(message.id, triangles_of_mesh(message.mesh, f"obstacles.{i}.mesh"))
        for i, message in enumerate(messages)
    )


def _entry(message: SurfaceMessage) -> SurfaceEntry:
    # Not validated, unlike other records: `make_surface` validates it and names the field.
    return SurfaceEntry.model_construct(
        id=message.id,
        vertices=_ring(message.vertices),
        holes=tuple(_ring(hole.vertices) for hole in message.holes),
        friction=message.friction,
    )


def _entry_message(entry: SurfaceEntry) -> SurfaceMessage:
    return SurfaceMessage(
        id=entry.id,
        vertices=_points(entry.vertices),
        holes=[PolygonRing(vertices=_points(hole)) for hole in entry.holes],
        friction=entry.friction,
    )


def _obstacle_message(obstacle: Obstacle) -> ObstacleMessage:
    return ObstacleMessage(id=obstacle.id, mesh=mesh_message(obstacle.triangles))


def _ring(points: Sequence[Point]) -> tuple[Triple, ...]:
    return tuple(triple(point) for point in points)


def _message(surface: Surface) -> SurfaceMessage:
    polygon = surface.polygon
    return SurfaceMessage(
        id=surface.id,
        vertices=_points(polygon.boundary),
        holes=[PolygonRing(vertices=_points(hole)) for hole in polygon.holes],
        friction=surface.friction,
    )


def _points(ring: Iterable[Iterable[float]]) -> list[Point]:
    return [vector_message(Point, vertex) for vertex in ring]
