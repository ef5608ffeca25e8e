"""Edges and guides: bounds and clearance hold at every point."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.guide.root import (
    GuidePath,
    PrmOptions,
    Roadmap,
    RootBounds,
    RootProblem,
    RootSearch,
    RrtOptions,
    shorten,
)
from rbprm_core.guide.root.prm import PrmSearch
from rbprm_core.guide.root.rrt import RrtSearch
from rbprm_core.guide.root_space import RootSegment
from rbprm_core.scenario import Scenario
from rbprm_core.scene import Scene

Make = Callable[..., Any]
SEARCHES: dict[str, Callable[[RootProblem], RootSearch]] = {
    "rrt": lambda problem: RrtSearch(problem, RrtOptions()),
    "prm": lambda problem: PrmSearch(problem, Roadmap(), PrmOptions()),
}
DENSE = 2e-3  # m between the points of a guide that are tested again


def dense(path: GuidePath) -> Array:
    """Root configurations (n, 7) of a path, DENSE apart on every edge."""
    points = [path.nodes[:1]]
    for a, b, length in zip(path.nodes, path.nodes[1:], np.diff(path.arc_lengths), strict=False):
        steps = int(np.ceil(length / DENSE))
        points.append(RootSegment(a, b).at_all(np.arange(1, steps + 1) / max(steps, 1)))
    return np.concatenate(points)


@pytest.mark.parametrize("planner", sorted(SEARCHES))
@pytest.mark.parametrize("seed", range(3))
def test_a_finished_guide_keeps_bounds_and_clearance_everywhere(
    make_ground: Make, rubble: Scenario, rubble_scene: Scene, planner: str, seed: int
) -> None:
    """A guide over rubble in tight bounds, found without the direct try, shortened and settled."""
    low, high = np.array([-2.0, -0.6, 0.45]), np.array([3.0, 0.6, 0.95])
    ground = make_ground(rubble_scene, RootBounds(low, high, np.array([0.25, 0.12, 0.05])))
    turns = [pin.rpy.rpyToMatrix(0.05, pitch, yaw) for pitch, yaw in ((0.1, 0.25), (-0.1, -0.25))]
    start, goal = (
        np.concatenate([[x, 0.0, 0.63], pin.Quaternion(turn).coeffs()])
        for x, turn in zip((-1.9, 2.5), turns, strict=True)
    )
    rng = np.random.default_rng(seed)
    search = SEARCHES[planner](ground.problem(start, goal))
    path, _ = search.find(Budget(), rng, direct=False)
    path = shorten(path, ground.edges, 60, Budget(), rng)
    path = ground.settler.settle(path, ground.edges, Budget())
    assert np.array_equal(path.nodes[[0, -1]], [start, goal])
    for root in dense(path):
        assert ground.space.outside(root) == ""
        assert not ground.condition._trunk.hits(root)


def test_an_edge_near_an_avoided_root_fails(make_ground: Make, flat_scene: Scene) -> None:
    bounds = RootBounds(np.array([-3.0, -2, 0.3]), np.array([3.0, 2, 1]), np.ones(3))
    ground = make_ground(flat_scene, bounds)
    a, b, beside = (np.array([x, y, 0.6, 0, 0, 0, 1]) for x, y in ((-1, 0), (1, 0), (0, 0.05)))
    assert ground.edges.holds(a, b)
    assert not ground.edges.avoids(a, b)
    ground.condition.avoid(beside, keep=(a, b))
    assert ground.edges.avoids(a, b)
    assert not ground.edges.holds(a, b)


def test_an_edge_out_of_bounds_fails(make_ground: Make, flat_scene: Scene) -> None:
    bounds = RootBounds(
        np.array([-3.0, -2, 0.3]), np.array([3.0, 2, 1]), np.array([0.01, 1.5, 1.5])
    )
    ground = make_ground(flat_scene, bounds)
    a, b = (
        np.concatenate([[0, 0, 0.6], pin.Quaternion(pin.rpy.rpyToMatrix(r, p, 0)).coeffs()])
        for p, r in ((0.25, -0.2), (-0.25, 0.2))
    )
    assert ground.condition.edge_holds(RootSegment(a, b), 10)
    assert not ground.edges.holds(a, b)  # the root yaws between the ends
