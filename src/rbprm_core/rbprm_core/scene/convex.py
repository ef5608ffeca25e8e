"""Many convex polygons at once: the common case of perceived surfaces, which come at 30 Hz."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array, BoolArray
from rbprm_core.scene.plane import Plane, plane_axes, ring_planes
from rbprm_core.scene.polygon import MIN_AREA, PLANAR_TOLERANCE, SAME_POINT, Polygon
from rbprm_core.validation import MAX_COORDINATE

MIN_TURN = 1e-6  # radians between successive edges; flatter corners are left to `make_polygon`
MAX_CORNERS = 16  # larger rings are left to `make_polygon`
PIECE_SHIFT = 2  # the piece starts this many vertices before the ring, as in `make_polygon`


def convex_polygons(rings: Array) -> list[Polygon | None]:
    """Return the polygon of each ring, equal to that of `make_polygon`, or None.

    Args:
        rings: (g, v, 3) boundaries of v vertices each, metres, planning frame.

    Returns:
        A polygon without holes for each ring; None where the ring is not clearly convex and valid,
        so that `make_polygon` has to make the polygon or raise the error.
    """
    count, size = rings.shape[:2]
    if not 3 <= size <= MAX_CORNERS:
        return [None] * count
    good = np.asarray((np.abs(rings) <= MAX_COORDINATE).all(axis=(1, 2)))  # False for NaN
    rings = np.where(good[:, None, None], rings, 0.0)
    edges = np.roll(rings, -1, axis=1) - rings
    lengths = np.sqrt((edges**2).sum(axis=2))
    good &= (lengths > SAME_POINT).all(axis=1)
    origins, normals, sizes = ring_planes(rings)
    good &= sizes >= MIN_AREA
    axes = plane_axes(normals)
    arms = rings - origins[:, None]
    good &= (np.abs(np.einsum("gvi,gi->gv", arms, normals)) <= PLANAR_TOLERANCE).all(axis=1)
    flat = arms @ axes
    good &= _is_convex(flat)
    lifted = origins[:, None] + flat @ axes.transpose(0, 2, 1)
    pieces = np.roll(lifted, PIECE_SHIFT, axis=1)
    areas = _areas(flat)
    outer = np.ones(size, dtype=bool)
    return [
        Polygon(
            # Copies, so that one polygon does not keep the arrays of all polygons alive.
            plane=Plane(origins[i].copy(), axes[i].copy(), normals[i].copy()),
            boundary=lifted[i].copy(),
            holes=(),
            pieces=(pieces[i].copy(),),
            outer_edges=(outer,),
            area=float(areas[i]),
        )
        if good[i]
        else None
        for i in range(count)
    ]


def _is_convex(flat: Array) -> BoolArray:
    """Return (g,) where a ring (g, v, 2) turns left at every corner and makes one full turn."""
    edges = np.roll(flat, -1, axis=1) - flat
    after = np.roll(edges, -1, axis=1)
    turn = edges[..., 0] * after[..., 1] - edges[..., 1] * after[..., 0]
    along = (edges * after).sum(axis=2)
    angles = np.arctan2(turn, along)
    # A five-pointed star turns left everywhere too, but makes two full turns.
    return np.asarray((angles > MIN_TURN).all(axis=1) & (angles.sum(axis=1) < 3 * np.pi))


def _areas(flat: Array) -> Array:
    """Return the area (g,) of rings (g, v, 2), in square metres for metres."""
    after = np.roll(flat, -1, axis=1)
    return np.asarray((flat[..., 0] * after[..., 1] - flat[..., 1] * after[..., 0]).sum(axis=1) / 2)
