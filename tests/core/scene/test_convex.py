"""Convex polygons at once: equal to those made one by one; other rings give None."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.scene.convex import MAX_CORNERS, convex_polygons
from rbprm_core.scene.polygon import make_polygon


def level(ring: list[tuple[float, float]]) -> Array:
    return np.array([(x, y, 0.0) for x, y in ring])


SQUARE = level([(0, 0), (1, 0), (1, 1), (0, 1)])


@given(st.integers(3, MAX_CORNERS), st.integers(0, 2**32 - 1))
def test_the_same_as_one_by_one(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, (8, size)), axis=1)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    circle = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=2)
    rings = circle @ rotation.T + rng.uniform(-20, 20, 3)
    for ring, polygon in zip(rings, convex_polygons(rings), strict=True):
        if polygon is None:  # corners too close to each other
            continue
        alone = make_polygon(ring)
        assert np.array_equal(polygon.plane.normal, alone.plane.normal)
        assert np.array_equal(polygon.plane.axes, alone.plane.axes)
        assert np.array_equal(polygon.boundary, alone.boundary)
        assert len(alone.pieces) == 1
        assert np.array_equal(polygon.pieces[0], alone.pieces[0])
        assert alone.outer_edges[0].all()
        assert polygon.outer_edges[0].tolist() == alone.outer_edges[0].tolist()
        assert polygon.area == pytest.approx(alone.area, rel=1e-12)


@pytest.mark.parametrize("size", [3, 4, 6])
def test_convex_rings_are_made(size: int) -> None:
    angles = np.arange(size) * 2 * np.pi / size
    ring = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    up, down = convex_polygons(np.array([ring, ring[::-1]]))
    assert up is not None
    assert down is not None
    assert up.plane.normal == pytest.approx([0, 0, 1])
    assert down.plane.normal == pytest.approx([0, 0, -1])


@pytest.mark.parametrize(
    "ring",
    [
        level([(0, 0), (1, 0), (0.2, 0.2), (0, 1)]),  # concave
        level([(0, 0), (1, 1), (1, 0), (0, 1)]),  # crosses itself
        level([(0, 0), (1, 0), (2, 0), (0, 1)]),  # a straight corner
        level([(0, 0), (0, 0), (1, 0), (0, 1)]),  # one point twice
        level([(0, 0), (1, 0), (2, 0), (3, 0)]),  # no area
        1e-5 * SQUARE,
        np.where(SQUARE == 1, np.nan, SQUARE),
        np.where(SQUARE == 1, np.inf, SQUARE),
        1e6 * SQUARE,
        SQUARE + np.outer([1, 0, 1, 0], [0, 0, 0.01]),  # not planar
    ],
)
def test_other_rings_give_none(ring: Array) -> None:
    good, bad = convex_polygons(np.array([SQUARE, ring]))
    assert good is not None
    assert bad is None


def test_a_star_is_not_convex() -> None:
    angles = np.arange(5) * 4 * np.pi / 5  # turns left at each corner, twice around
    star = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    assert convex_polygons(star[None]) == [None]


def test_too_many_corners_give_none() -> None:
    angles = np.arange(MAX_CORNERS + 1) * 2 * np.pi / (MAX_CORNERS + 1)
    ring = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    assert convex_polygons(ring[None]) == [None]
