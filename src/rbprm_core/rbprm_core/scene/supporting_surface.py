"""Which surface carries a contact: the whole of it, wherever that surface came from."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from rbprm_core.scene.scene import Scene
from rbprm_core.scene.surface import Surface

Array = NDArray[np.float64]

OFF = 2e-3  # metres off the plane or beyond the boundary; a plan is held to 3 mm by its check
REACH = 6 * OFF  # metres from the boundary's box; an outline that grows by OFF has mitred corners
TILT = float(np.deg2rad(2.0))  # between the normals; a plan is held to 3 degrees


def supporting_surface(
    scene: Scene,
    points: Array,
    normal: Array,
    identity: str = "",
    off: float = OFF,
    tilt: float = TILT,
) -> Surface | None:
    """The surface that carries all points of a contact, None where there is none.

    A surface that was given another id or another outline still carries what lies on it.

    Args:
        points: (k, 3) of one contact, the corners of a patch in order, metres. normal: (3,) of it.
        identity: of the surface that is asked first.
        off: metres that each point may be off the plane. tilt: radians between the normals.
    """
    index = scene.index.get(identity)
    if index is not None and carries(scene.surfaces[index], points, normal, off, tilt):
        return scene.surfaces[index]
    low, high = scene.boxes  # the cheapest first: most surfaces are elsewhere
    margin = REACH + off
    near = (low <= points.min(axis=0) + margin) & (high >= points.max(axis=0) - margin)
    around = (scene.surfaces[i] for i in np.flatnonzero(near.all(axis=1)))
    return next((s for s in around if carries(s, points, normal, off, tilt)), None)


def carries(
    surface: Surface, points: Array, normal: Array, off: float = OFF, tilt: float = TILT
) -> bool:
    """True where a surface carries all points (k, 3) of a contact with a normal (3,)."""
    plane = surface.polygon.plane
    if normal @ plane.normal < np.cos(tilt):
        return False
    if (np.abs((points - plane.origin) @ plane.normal) > off).any():
        return False
    return _covers(surface, points)


def _covers(surface: Surface, points: Array) -> bool:
    """True where points, and the patch between them, lie within a surface's outline."""
    flat = surface.polygon.plane.flatten(points)
    shape = shapely.Polygon(flat) if len(flat) > 2 else shapely.Point(flat[0])
    return bool(surface.polygon.shrunk(-OFF).covers(shape))
