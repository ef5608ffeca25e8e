"""Random shortcuts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.errors import Cancelled
from rbprm_core.guide.root import EdgeTest, GuidePath, Reachability, RootBounds, RootSpace, shorten
from rbprm_core.guide.root_space import distance
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

Box = Callable[..., list[Surface]]
LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
BOUNDS = RootBounds(np.array([-3.0, -3, 0.3]), np.array([3.0, 3, 1]), np.array([0.5, 0.2, 0.2]))


def path_through(*corners: tuple[float, float]) -> GuidePath:
    return GuidePath(np.array([[x, y, 0.6, 0, 0, 0, 1] for x, y in corners]))


DETOUR = path_through((-2, 0), (-2, 2), (-1, 2.2), (0, 1.6), (1, 2.2), (2, 2), (2, 0))


@pytest.fixture(scope="module")
def edge(hyq_data: RobotData, make_box: Box) -> EdgeTest:
    """Flat ground with a block between start and goal."""
    corners = [[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]]
    block = make_box("block", np.array([-0.3, -0.5, 0.0]), np.array([0.3, 0.5, 2.0]))
    scene = Scene([make_surface("g", corners, 0.5), *block])
    space = RootSpace(BOUNDS, np.zeros(0), np.zeros(0))
    return EdgeTest(space, Reachability(hyq_data, scene, LEGS), 0.05)


@pytest.mark.parametrize("seed", range(3))
def test_a_shorter_way_that_holds(edge: EdgeTest, seed: int) -> None:
    short = shorten(DETOUR, edge, 60, Budget(), np.random.default_rng(seed))
    assert short.length < 0.85 * DETOUR.length
    assert short.length > 4.01  # the block is still there
    assert np.array_equal(short.nodes[0], DETOUR.nodes[0])
    assert np.array_equal(short.nodes[-1], DETOUR.nodes[-1])
    for a, b in zip(short.nodes, short.nodes[1:], strict=False):
        assert float(distance(a, b)) < 1e-9 or edge.holds(a, b)


def test_no_loop_makes_a_path_longer(edge: EdgeTest) -> None:
    lengths = [
        shorten(DETOUR, edge, loops, Budget(), np.random.default_rng(0)).length
        for loops in (0, 1, 2, 4, 8, 16, 32)
    ]
    assert lengths[0] == DETOUR.length
    assert lengths == sorted(lengths, reverse=True)


def test_a_straight_path_stays(edge: EdgeTest) -> None:
    straight = path_through((-2, 2), (0, 2), (2, 2))
    short = shorten(straight, edge, 30, Budget(), np.random.default_rng(0))
    assert short.length == pytest.approx(4)


def test_the_caller_may_end_it(edge: EdgeTest) -> None:
    with pytest.raises(Cancelled, match="shortcut"):
        shorten(DETOUR, edge, 10, Budget(cancelled=lambda: True), np.random.default_rng(0))
