"""Surfaces from triangle lists in marker arrays, which many perception stacks publish."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.validation import MAX_COORDINATE, coordinates
from rbprm_ros.conversions.geometry import (
    nanoseconds_of,
    placement_of_message,
    quadruple,
    require_frame,
    triple,
)
from rbprm_ros.conversions.meshes import (
    CORNERS_PER_TRIANGLE,
    MIN_TRIANGLE,
    areas,
    points_array,
    require_triangles,
)
from rbprm_ros.environment.updates import MeshUpdate, SurfaceUpdate
from rbprm_ros.settings import Settings

Array = NDArray[np.float64]

UNSET_ORIENTATION = (0.0, 0.0, 0.0, 0.0)  # stands for the identity, as in RViz
ACTIONS = (Marker.ADD, Marker.DELETE, Marker.DELETEALL)


def update_of_markers(message: MarkerArray, settings: Settings) -> SurfaceUpdate:
    """A change of the environment in which each marker is a mesh with the id "ns/id".

    Contact surfaces are found in it as in a mesh of a scenario; the rest is an obstacle. The
    deletion of an unknown marker does nothing, as in RViz. Colours and lifetimes are ignored.

    Args:
        message: the markers.
        settings: parameters of the node.

    Raises:
        InvalidInput: another frame or type of marker, an unknown action, points that make no
            triangles, a scale or pose that cannot be used, or more than the parameters allow.
    """
    set_meshes: dict[str, MeshUpdate] = {}
    removed: dict[str, None] = {}
    cleared: dict[str, None] = {}
    stamp = 0
    if len(message.markers) > settings.max_obstacles:
        reason = f"are too many; the parameter max_obstacles is {settings.max_obstacles}"
        raise InvalidInput("markers", f"{len(message.markers)} markers", reason)
    count = sum(len(marker.points) for marker in message.markers) // CORNERS_PER_TRIANGLE
    require_triangles("markers", count, settings)
    for i, marker in enumerate(message.markers):
        field, identity = f"markers.{i}", f"{marker.ns}/{marker.id}"
        require_frame(marker.header, settings.planning_frame, f"{field}.header")
        stamp = max(stamp, nanoseconds_of(marker.header.stamp))
        match marker.action:
            case Marker.ADD:
                set_meshes[identity] = _mesh(marker, identity, field, settings)
            case Marker.DELETE:
                set_meshes.pop(identity, None)
                removed[identity] = None
            case Marker.DELETEALL:
                set_meshes = _others(set_meshes.values(), marker.ns)
                cleared[marker.ns] = None
            case _:
                reason = f"must be one of {ACTIONS}: add or modify, delete, delete all"
                raise InvalidInput(f"{field}.action", marker.action, reason)
    return SurfaceUpdate(
        is_diff=True,
        stamp=stamp,
        meshes=tuple(set_meshes.values()),
        removed_meshes=tuple(removed),
        cleared=tuple(cleared),
        classification=settings.classification,
    )


def _others(meshes: Iterable[MeshUpdate], namespace: str) -> dict[str, MeshUpdate]:
    """The meshes of other namespaces, by id; "" stands for all namespaces."""
    return {m.id: m for m in meshes if namespace not in ("", m.namespace)}


def _mesh(marker: Marker, identity: str, field: str, settings: Settings) -> MeshUpdate:
    if marker.type != Marker.TRIANGLE_LIST:
        reason = f"must be TRIANGLE_LIST ({Marker.TRIANGLE_LIST}); publish others on another topic"
        raise InvalidInput(f"{field}.type", marker.type, reason)
    if not marker.points or len(marker.points) % CORNERS_PER_TRIANGLE:
        reason = "must be three for each triangle, and one triangle at least"
        raise InvalidInput(f"{field}.points", f"{len(marker.points)} points", reason)
    scale = coordinates(f"{field}.scale", triple(marker.scale), (3,))
    if (scale <= 0).any():
        reason = "must be positive; 1, 1, 1 where the points are in metres"
        raise InvalidInput(f"{field}.scale", scale.tolist(), reason)
    placement = _placement(marker, f"{field}.pose").transform
    points = points_array(marker.points, f"{field}.points") * scale
    triangles = (points @ placement.rotation.T + placement.translation).reshape(-1, 3, 3)
    if np.abs(triangles).max() > MAX_COORDINATE:
        reason = f"must lie within {MAX_COORDINATE:g} m of the origin, scaled and placed"
        raise InvalidInput(f"{field}.points", f"{len(points)} points", reason)
    triangles = triangles[areas(triangles) >= MIN_TRIANGLE]  # a flat triangle bounds no volume
    if not len(triangles):
        reason = "make no triangle with an area"
        raise InvalidInput(f"{field}.points", f"{len(points)} points", reason)
    return MeshUpdate(identity, triangles, settings.marker_friction, marker.ns)


def _placement(marker: Marker, field: str) -> Placement:
    if quadruple(marker.pose.orientation) == UNSET_ORIENTATION:
        return Placement.parse(triple(marker.pose.position), field=field)
    return placement_of_message(marker.pose, field)
