"""Polygons: refused input, and convex pieces that cover the polygon."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.scene.polygon import make_polygon

SQUARE: list[list[float]] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
unit = st.floats(0, 1)


@st.composite
def flat_rings(draw: st.DrawFn, min_size: int = 4, max_size: int = 14) -> Array:
    """A random simple polygon (n, 2) about the origin, counter-clockwise, mostly concave."""
    count = draw(st.integers(min_size, max_size))
    turn = [(i + 0.8 * draw(unit)) * 2 * np.pi / count for i in range(count)]
    reach = [0.3 + 2 * draw(unit) for _ in range(count)]
    return np.array([(r * np.cos(a), r * np.sin(a)) for r, a in zip(reach, turn, strict=True)])


@st.composite
def transforms(draw: st.DrawFn) -> pin.SE3:
    """A random rotation and a translation of some metres."""
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    quaternion = pin.Quaternion(rng.normal(size=4))
    quaternion.normalize()
    return pin.SE3(quaternion.matrix(), rng.uniform(-20, 20, 3))


def lifted(ring: Array, transform: pin.SE3) -> Array:
    level = np.column_stack([ring, np.zeros(len(ring))])
    return np.asarray(level @ transform.rotation.T + transform.translation)


def shoelace(ring: Array) -> float:
    x, y = ring.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@given(flat_rings(), transforms(), st.booleans())
def test_convex_pieces_are_a_partition(ring: Array, transform: pin.SE3, with_hole: bool) -> None:
    radius = min(np.linalg.norm((ring + np.roll(ring, -1, axis=0)) / 2, axis=1).min(), 0.3)
    hole = 0.1 * radius * np.array([[1, 0], [0, 1], [-1, -0.2], [0, -1]])
    holes = (lifted(hole, transform),) if with_hole and encloses(ring, hole) else ()
    polygon = make_polygon(lifted(ring, transform), holes)
    plane = polygon.plane

    whole = shapely.Polygon(
        plane.flatten(polygon.boundary), [plane.flatten(inner) for inner in polygon.holes]
    )
    wanted = shoelace(ring) - (abs(shoelace(hole)) if holes else 0)
    assert polygon.area == pytest.approx(wanted, rel=1e-9)
    assert len(polygon.holes) == len(holes)

    flat = [plane.flatten(piece) for piece in polygon.pieces]
    pieces = [shapely.Polygon(piece) for piece in flat]
    assert sum(map(shoelace, flat)) == pytest.approx(polygon.area, rel=1e-9)
    assert shapely.unary_union(pieces).symmetric_difference(whole).area < 1e-9
    for piece, shape in zip(flat, pieces, strict=True):
        assert shoelace(piece) > 0  # counter-clockwise seen from outside
        assert shape.convex_hull.area - shape.area < 1e-9
    for i, shape in enumerate(pieces):
        assert all(shape.intersection(other).area < 1e-9 for other in pieces[:i])


@given(flat_rings(), transforms())
def test_outer_edges_are_the_boundary(ring: Array, transform: pin.SE3) -> None:
    polygon = make_polygon(lifted(ring, transform))
    border = shapely.Polygon(polygon.plane.flatten(polygon.boundary)).exterior
    outer = 0.0
    for piece, marks in zip(polygon.pieces, polygon.outer_edges, strict=True):
        flat = polygon.plane.flatten(piece)
        after = np.roll(flat, -1, axis=0)
        for a, b, on_border in zip(flat, after, marks, strict=True):
            if on_border:
                outer += float(np.linalg.norm(b - a))
                assert border.distance(shapely.Point((a + b) / 2)) < 1e-9
    assert outer == pytest.approx(border.length, rel=1e-9)


@given(flat_rings(), transforms())
def test_the_winding_gives_the_normal(ring: Array, transform: pin.SE3) -> None:
    points = lifted(ring, transform)
    outward = make_polygon(points)
    inward = make_polygon(points[::-1])
    assert outward.plane.normal == pytest.approx(transform.rotation[:, 2], abs=1e-9)
    assert inward.plane.normal == pytest.approx(-transform.rotation[:, 2], abs=1e-9)
    assert inward.area == pytest.approx(outward.area)


def test_repeated_points_are_one() -> None:
    polygon = make_polygon([SQUARE[0], SQUARE[0], *SQUARE[1:], SQUARE[0]])
    assert len(polygon.boundary) == 4
    assert polygon.area == pytest.approx(1)


def test_a_point_in_the_middle_of_an_edge_is_fine() -> None:
    polygon = make_polygon([SQUARE[0], [0.5, 0, 0], *SQUARE[1:]])
    assert polygon.area == pytest.approx(1)


def test_a_vertex_may_be_a_millimetre_off_the_plane() -> None:
    assert make_polygon([*SQUARE[:3], [0, 1, 1e-3]]).area == pytest.approx(1, rel=1e-2)


def test_a_hole_may_wind_either_way() -> None:
    hole = [[0.4, 0.4, 0], [0.6, 0.4, 0], [0.6, 0.6, 0]]
    for ring in (hole, hole[::-1]):
        polygon = make_polygon(SQUARE, (ring,))
        assert polygon.area == pytest.approx(0.98)


@pytest.mark.parametrize(
    ("vertices", "reason"),
    [
        ([], "shape"),
        ([[0, 0, 0]], "three distinct points"),
        ([[0, 0, 0], [1, 0, 0]], "three distinct points"),
        ([[0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]], "three distinct points"),
        ([[0, 0], [1, 0], [1, 1]], "shape"),
        ("square", "numbers"),
        ([[0, 0, 0], [1, 0, 0], [1, 1]], "numbers"),
        ([[0, 0, 0], [1, 0, 0], [1, float("nan"), 0]], "finite"),
        ([[0, 0, 0], [1, 0, 0], [float("inf"), 1, 0]], "finite"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], "no area"),
        ([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]], "no area"),
        ([[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 1, 0]], "simple"),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0]], "planar"),
        ([[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0, 0], [0, 2, 0]], "simple"),
    ],
)
def test_a_bad_polygon_is_refused(vertices: Any, reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        make_polygon(vertices, field="surfaces.3")
    assert caught.value.field == "surfaces.3.vertices"


@pytest.mark.parametrize(
    ("hole", "reason"),
    [
        ([[2, 2, 0], [3, 2, 0], [3, 3, 0]], "simple"),  # outside
        ([[0.5, 0.5, 0], [1.5, 0.5, 0], [0.5, 0.7, 0]], "simple"),  # across the boundary
        ([[0.2, 0.2, 0.3], [0.8, 0.2, 0.3], [0.5, 0.8, 0.3]], "planar"),
        ([[0.2, 0.2, 0], [0.8, 0.2, 0]], "three distinct points"),
        ([[0.2, 0.2, float("nan")], [0.8, 0.2, 0], [0.5, 0.8, 0]], "finite"),
    ],
)
def test_a_bad_hole_is_refused(hole: Any, reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason):
        make_polygon(SQUARE, (hole,))


def encloses(ring: Array, hole: Array) -> bool:
    return bool(shapely.Polygon(ring).contains_properly(shapely.Polygon(hole)))


def test_coordinates_beyond_all_geometry_are_refused() -> None:
    with pytest.raises(InvalidInput, match="within") as caught:
        make_polygon([[-1e200, 0, 0], [1e200, 0, 0], [0, 1e200, 0]], field="surfaces.3")
    assert caught.value.field == "surfaces.3.vertices"
