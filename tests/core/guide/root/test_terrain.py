"""Terrain below a guide: height, and offset to the nearest surface."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.guide.root.terrain import Terrain
from rbprm_core.scene import Scene, make_surface

REACH = 0.5
BEAM = [[-1, -0.1, 0], [1, -0.1, 0], [1, 0.1, 0], [-1, 0.1, 0]]
RAMP = [[2, -1, 0], [4, -1, 0.4], [4, 1, 0.4], [2, 1, 0]]
SHELF = [[2, -1, 1.5], [3, -1, 1.5], [3, 1, 1.5], [2, 1, 1.5]]
WALL = [[0, 2, 0], [1, 2, 0], [1, 2, 1], [0, 2, 1]]


@pytest.fixture(scope="module")
def terrain() -> Terrain:
    """A beam, a ramp with a shelf over it, and a wall."""
    rings = {"beam": BEAM, "ramp": RAMP, "shelf": SHELF, "wall": WALL}
    return Terrain(Scene([make_surface(name, ring, 0.5) for name, ring in rings.items()]), REACH)


@given(x=st.floats(2.01, 3.99), y=st.floats(-0.99, 0.99))
def test_the_highest_surface_under_the_ceiling(terrain: Terrain, x: float, y: float) -> None:
    points = np.array([[x, y, 0.0], [x, y, 0.0]])
    low, high = terrain.heights(points, np.array([1.0, 2.0]))
    assert low == pytest.approx(0.2 * (x - 2))
    assert high == pytest.approx(1.5 if x <= 3 else low)


def test_no_ground_beside_it(terrain: Terrain) -> None:
    points = np.array([[0.0, 0.3, 0.0], [0.5, 2.0, 0.0], [0.0, 0.0, 0.0]])
    heights = terrain.heights(points, np.ones(3))
    assert np.isnan(heights).tolist() == [True, True, False]


@given(x=st.floats(-0.9, 0.9), y=st.floats(0.11, 0.1 + REACH - 0.01))
def test_the_way_to_a_beam_is_straight_across(terrain: Terrain, x: float, y: float) -> None:
    points = np.array([[x, y, 0.0], [x, -y, 0.0]])
    offsets = terrain.offsets(points, np.ones(2))
    assert offsets == pytest.approx(np.array([[0, 0.1 - y], [0, y - 0.1]]), abs=1e-9)


def test_what_is_far_or_above_is_no_ground(terrain: Terrain) -> None:
    points = np.array([[0.0, 0.1 + REACH + 0.05, 0.0], [4.2, 0.0, 0.0]])
    assert not terrain.offsets(points, np.array([1.0, 0.1])).any()
    assert terrain.offsets(points, np.ones(2))[1] == pytest.approx([-0.2, 0])
