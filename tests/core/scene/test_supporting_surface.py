"""The supporting surface of a contact after changes of ids and outlines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.scene.supporting_surface import (
    MAX_DISTANCE,
    MAX_TILT,
    supporting_surface,
    supports,
)

UP = np.array([0.0, 0.0, 1.0])
PATCH = np.array([[0.1, 0.05, 0.0], [-0.1, 0.05, 0.0], [-0.1, -0.05, 0.0], [0.1, -0.05, 0.0]])


def tile(name: str, low: float, high: float, height: float = 0.0, *holes: Array) -> Surface:
    ring = [[low, -1, height], [high, -1, height], [high, 1, height], [low, 1, height]]
    return make_surface(name, ring, 0.5, holes)


def test_the_surface_with_the_id_comes_first() -> None:
    scene = Scene([tile("a", -1, 1), tile("b", -2, 2)])
    for name in ("a", "b"):
        found = supporting_surface(scene, PATCH, UP, name)
        assert found is not None
        assert found.id == name


def test_another_id_or_outline_supports_as_well() -> None:
    for scene in (Scene([tile("new", -1, 1)]), Scene([tile("old", 3, 4), tile("new", -1, 1)])):
        found = supporting_surface(scene, PATCH, UP, "old")
        assert found is not None
        assert found.id == "new"


@pytest.mark.parametrize(
    "surface",
    [
        tile("low", -1, 1, -2 * MAX_DISTANCE),
        tile("half", 0, 1),
        tile("holed", -1, 1, 0.0, np.array([[-0.02, -0.02, 0], [0, 0.02, 0], [0.02, -0.02, 0]])),
        make_surface("below", [[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], 0.5),
    ],
    ids=lambda surface: surface.id,
)
def test_support_of_a_part_only_is_no_support(surface: Surface) -> None:
    assert supporting_surface(Scene([surface]), PATCH, UP, surface.id) is None


@pytest.mark.parametrize(("angle", "supported"), [(0.5 * MAX_TILT, True), (1.5 * MAX_TILT, False)])
def test_normals_may_differ_a_little(angle: float, supported: bool) -> None:
    slope = np.tan(angle)
    ring = [[x, y, x * slope] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    scene = Scene([make_surface("slope", ring, 0.5)])
    point = np.zeros((1, 3))
    assert (supporting_surface(scene, point, UP) is not None) is supported


def test_a_point_beyond_the_edge_by_rounding_is_supported() -> None:
    scene = Scene([tile("a", 0, 1)])
    assert supporting_surface(scene, np.array([[-0.5 * MAX_DISTANCE, 0.0, 0.0]]), UP) is not None
    assert supporting_surface(scene, np.array([[-2 * MAX_DISTANCE, 0.0, 0.0]]), UP) is None


@given(seed=st.integers(0, 2**32 - 1))
def test_the_search_by_boxes_misses_no_surface(seed: int) -> None:
    """Points near sharp corners, off the edge by about the tolerance, among many surfaces."""
    rng = np.random.default_rng(seed)
    surfaces = []
    for i in range(20):
        tip, left, right = rng.uniform(-1, 1, (3, 2))
        turn = (left - tip)[0] * (right - tip)[1] - (left - tip)[1] * (right - tip)[0]
        if abs(turn) > 1e-2:
            ring = np.column_stack([(tip, left, right), np.zeros(3)])
            surfaces.append(make_surface(f"s{i}", ring if turn > 0 else ring[::-1], 0.5))
    scene = Scene(surfaces)
    corners = np.concatenate([surface.polygon.boundary for surface in surfaces])
    for corner in corners:
        point = corner + np.append(rng.uniform(-3 * MAX_DISTANCE, 3 * MAX_DISTANCE, 2), 0.0)
        wanted = [s for s in surfaces if supports(s, point[None], UP)]
        assert supporting_surface(scene, point[None], UP) is (wanted[0] if wanted else None)
