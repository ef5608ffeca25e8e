"""Many convex polygons at once: what perception mostly sends, thirty times a second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.scene.plane import Plane, plane_axes, ring_planes
from rbprm_core.scene.polygon import MIN_AREA, PLANAR_TOLERANCE, SAME_POINT, Polygon
from rbprm_core.validation import MAX_COORDINATE

Array = NDArray[np.float64]

SHARP = 1e-6  # sine of the angle between edges; flatter corners are left to `make_polygon`
MAX_CORNERS = 16  # rings of more are left to `make_polygon`
FIRST_OF_PIECE = 2  # places from the end; where `make_polygon` too begins the piece


def convex_polygons(rings: Array) -> list[Polygon | None]:
    """Polygons without holes, as `make_polygon` makes them.

    Args:
        rings: (g, v, 3) boundaries of v vertices each, metres.

    Returns:
        For each ring its polygon, None where it is not clearly convex and valid: `make_polygon`
        then makes it, or says what is wrong.
    """
    count, size = rings.shape[:2]
    if not 3 <= size <= MAX_CORNERS:
        return [None] * count
    good = np.asarray((np.abs(rings) <= MAX_COORDINATE).all(axis=(1, 2)))  # False of NaN
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
    pieces = np.roll(lifted, FIRST_OF_PIECE, axis=1)
    areas = _areas(flat)
    outer = np.ones(size, dtype=bool)
    return [
        Polygon(
            # Copies: one polygon that is kept must not keep the arrays of all.
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


def _is_convex(flat: Array) -> NDArray[np.bool_]:
    """(g,) True where a ring (g, v, 2) turns left at every corner, and once around in all."""
    edges = np.roll(flat, -1, axis=1) - flat
    after = np.roll(edges, -1, axis=1)
    turn = edges[..., 0] * after[..., 1] - edges[..., 1] * after[..., 0]
    along = (edges * after).sum(axis=2)
    angles = np.arctan2(turn, along)
    # A star turns left everywhere too, but more than once around.
    return np.asarray((angles > SHARP).all(axis=1) & (angles.sum(axis=1) < 3 * np.pi))


def _areas(flat: Array) -> Array:
    """Area (g,) of rings (g, v, 2)."""
    after = np.roll(flat, -1, axis=1)
    return np.asarray((flat[..., 0] * after[..., 1] - flat[..., 1] * after[..., 0]).sum(axis=1) / 2)
