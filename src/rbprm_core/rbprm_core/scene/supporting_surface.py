"""The supporting surface of a contact: the one that holds all of the contact's points."""

from __future__ import annotations

import numpy as np
import shapely

from rbprm_core.arrays import Array
from rbprm_core.scene.scene import Scene
from rbprm_core.scene.surface import Surface

MAX_DISTANCE = 2e-3  # metres off the plane or beyond the boundary; the plan check allows 3 mm
MAX_TILT = float(np.deg2rad(2.0))  # radians between the normals; the plan check allows 3 degrees
BOX_MARGIN = 6 * MAX_DISTANCE  # metres; mitred corners of a grown outline reach farther out


def supporting_surface(
    scene: Scene,
    points: Array,
    normal: Array,
    identity: str = "",
    off: float = MAX_DISTANCE,
    tilt: float = MAX_TILT,
) -> Surface | None:
    """Return the surface that supports all points of a contact, None if there is none.

    It is found by geometry, so that a contact keeps its support where surfaces get another id or
    another outline.

    Args:
        scene: surfaces to search.
        points: (k, 3) contact points, a patch's corners in order, metres, planning frame.
        normal: (3,) unit normal of the contact, planning frame.
        identity: id of the surface that is tried first.
        off: greatest distance of a point from the plane of the surface, metres.
        tilt: greatest angle between the normals of contact and surface, radians.
    """
    index = scene.index.get(identity)
    if index is not None and supports(scene.surfaces[index], points, normal, off, tilt):
        return scene.surfaces[index]
    low, high = scene.boxes  # cheap test first: most surfaces are far from the contact
    margin = BOX_MARGIN + off
    near = (low <= points.min(axis=0) + margin) & (high >= points.max(axis=0) - margin)
    around = (scene.surfaces[i] for i in np.flatnonzero(near.all(axis=1)))
    return next((s for s in around if supports(s, points, normal, off, tilt)), None)


def supports(
    surface: Surface,
    points: Array,
    normal: Array,
    off: float = MAX_DISTANCE,
    tilt: float = MAX_TILT,
) -> bool:
    """Return whether a surface supports all points of a contact.

    Args:
        surface: surface to test.
        points: (k, 3) contact points, a patch's corners in order, metres, planning frame.
        normal: (3,) unit normal of the contact, planning frame.
        off: greatest distance of a point from the plane of the surface, metres.
        tilt: greatest angle between the normals of contact and surface, radians.
    """
    plane = surface.polygon.plane
    if normal @ plane.normal < np.cos(tilt):
        return False
    if (np.abs((points - plane.origin) @ plane.normal) > off).any():
        return False
    return _covers(surface, points)


def _covers(surface: Surface, points: Array) -> bool:
    """Return whether points (k, 3), and the patch between them, lie within a surface's outline."""
    flat = surface.polygon.plane.flatten(points)
    shape = shapely.Polygon(flat) if len(flat) > 2 else shapely.Point(flat[0])
    return bool(surface.polygon.shrunk(-MAX_DISTANCE).covers(shape))
