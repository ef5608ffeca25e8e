"""Surfaces as they come and as perception sends them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from geometry_msgs.msg import Point
from rbprm_msgs.msg import PolygonRing, SurfaceArray
from rbprm_msgs.msg import Surface as SurfaceMessage
from std_msgs.msg import Header

from rbprm_core.errors import InvalidInput
from rbprm_core.plan import SurfaceEntry
from rbprm_core.scene import Surface
from rbprm_ros.conversions.geometry import (
    Triple,
    nanoseconds_of,
    require_frame,
    triple,
    vector_message,
)
from rbprm_ros.environment import SurfaceUpdate
from rbprm_ros.parameters import Settings


def update_of_message(message: SurfaceArray, settings: Settings) -> SurfaceUpdate:
    """An update of the environment; its polygons are validated where they are taken in.

    Raises:
        InvalidInput: another frame, no time, or more than the parameters allow.
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
    )


def surfaces_message(surfaces: Iterable[Surface], header: Header) -> SurfaceArray:
    """A snapshot of surfaces."""
    return SurfaceArray(header=header, surfaces=[_message(surface) for surface in surfaces])


def _entry(message: SurfaceMessage) -> SurfaceEntry:
    # Not validated, unlike a usual record: that is for `make_surface`, which names the field.
    return SurfaceEntry.model_construct(
        id=message.id,
        vertices=_ring(message.vertices),
        holes=tuple(_ring(hole.vertices) for hole in message.holes),
        friction=message.friction,
    )


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


def _points(ring: np.ndarray) -> list[Point]:
    return [vector_message(Point, vertex) for vertex in ring]
