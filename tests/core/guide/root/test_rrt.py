"""The bidirectional RRT, its sampler and its trees."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.errors import Cancelled, NoGuideFound, TimeLimitReached
from rbprm_core.guide.root import (
    EdgeTest,
    GuideOptions,
    GuidePath,
    Reachability,
    RootBounds,
    RootProblem,
    RootSampler,
    RootSpace,
    RrtOptions,
)
from rbprm_core.guide.root.rrt import RrtSearch, Tree
from rbprm_core.guide.root_space import distance
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

Box = Callable[..., list[Surface]]
LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
START, GOAL = (np.array([x, 0, 0.6, 0, 0, 0, 1]) for x in (-2.0, 2.0))
BOUNDS = RootBounds(np.array([-3.0, -2, 0.3]), np.array([3.0, 2, 1]), np.array([0.5, 0.2, 0.2]))


@dataclass
class Search:
    """A robot in a scene, and the search for paths in it."""

    data: RobotData
    scene: Scene

    def __post_init__(self) -> None:
        self.space = RootSpace(BOUNDS, np.zeros(0), np.zeros(0))
        self.condition = Reachability(self.data, self.scene, LEGS)
        self.sampler = RootSampler(
            self.space, self.scene, self.condition, self.data.height, np.zeros(0)
        )
        self.edges = EdgeTest(self.space, self.condition, GuideOptions().resolution)

    def run(
        self, seed: int = 0, budget: Budget | None = None, iterations: int = 3000, **how: bool
    ) -> GuidePath:
        problem = RootProblem(START, GOAL, self.edges, self.sampler)
        search = RrtSearch(problem, RrtOptions(iterations=iterations))
        path, nodes = search.find(budget or Budget(), np.random.default_rng(seed), **how)
        assert nodes >= len(path.nodes)
        return path


def ground(name: str, low: float, high: float) -> Surface:
    return make_surface(name, [[low, -3, 0], [high, -3, 0], [high, 3, 0], [low, 3, 0]], 0.5)


@pytest.fixture(scope="module")
def open_way(hyq_data: RobotData) -> Search:
    return Search(hyq_data, Scene([ground("g", -4, 4)]))


@pytest.fixture(scope="module")
def around(hyq_data: RobotData, make_box: Box) -> Search:
    """A wall that leaves a passage on one side."""
    wall = make_box("wall", np.array([-0.2, -3, 0.0]), np.array([0.2, 0.5, 2.0]))
    return Search(hyq_data, Scene([ground("g", -4, 4), *wall]))


@pytest.fixture(scope="module")
def gap(hyq_data: RobotData) -> Search:
    """Two islands three metres apart."""
    return Search(hyq_data, Scene([ground("a", -4, -1.5), ground("b", 1.5, 4)]))


def test_an_open_way_is_straight(open_way: Search) -> None:
    path = open_way.run()
    assert path.length == pytest.approx(4)
    assert np.abs(path.nodes[:, 1]).max() < 1e-12


@pytest.mark.parametrize("seed", range(4))
def test_a_path_holds_from_end_to_end(around: Search, seed: int) -> None:
    path = around.run(seed)
    assert np.array_equal(path.nodes[0], START)
    assert np.array_equal(path.nodes[-1], GOAL)
    assert path.nodes[:, 1].max() > 0.5  # past the wall
    assert np.linalg.norm(path.nodes[:, 3:7], axis=1) == pytest.approx(np.ones(len(path.nodes)))
    step, resolution = RrtOptions().step, GuideOptions().resolution
    assert np.diff(path.arc_lengths).max() <= step + 1e-9
    for s in np.arange(0, path.length, resolution / 2):
        root = path.root(s)
        assert around.space.contains(root)
    for s in path.arc_lengths:
        assert around.condition.holds(path.root(s))
    for a, b in zip(path.nodes, path.nodes[1:], strict=False):
        # An edge was tested in the direction in which its tree grew.
        assert around.edges.holds(a, b) or around.edges.holds(b, a)


def test_the_seed_decides(around: Search) -> None:
    first, again, other = around.run(5), around.run(5), around.run(6)
    assert np.array_equal(first.nodes, again.nodes)
    assert not np.array_equal(first.nodes, other.nodes)


def test_without_the_direct_try_the_way_is_found_too(open_way: Search) -> None:
    path = open_way.run(1, direct=False)
    assert np.array_equal(path.nodes[-1], GOAL)
    assert path.length >= 4


def test_no_way_over_a_gap(gap: Search) -> None:
    with pytest.raises(NoGuideFound, match="60 samples did not connect") as caught:
        gap.run(iterations=60)
    assert caught.value.nodes >= 2


def test_the_time_limit_ends_the_search(gap: Search) -> None:
    budget = Budget(0.2)
    with pytest.raises(TimeLimitReached, match="guide"):
        gap.run(budget=budget, iterations=10**9)
    assert budget.elapsed < 2


def test_the_caller_may_end_the_search(gap: Search) -> None:
    answers = iter([False] * 20)
    with pytest.raises(Cancelled, match="guide"):
        gap.run(budget=Budget(cancelled=lambda: next(answers, True)), iterations=10**9)


def test_samples_are_inside_and_reachable_and_everywhere(around: Search) -> None:
    rng = np.random.default_rng(0)
    found = [around.sampler.draw(rng) for _ in range(60)]
    roots = np.array([root for root in found if root is not None])
    assert len(roots) > 50
    assert all(around.space.contains(root) and around.condition.holds(root) for root in roots)
    assert np.ptp(roots[:, 0]) > 3
    assert np.ptp(roots[:, 1]) > 2


def test_without_surfaces_samples_still_come(hyq_data: RobotData) -> None:
    scene = Scene([], np.array([[[50, 0, 0], [51, 0, 0], [50, 1, 0.0]]]))
    space = RootSpace(BOUNDS, np.zeros(0), np.zeros(0))
    condition = Reachability(hyq_data, scene, ())
    sampler = RootSampler(space, scene, condition, hyq_data.height, np.zeros(0))
    root = sampler.draw(np.random.default_rng(0))
    assert root is not None
    assert space.contains(root)


def test_branches_and_nearest_nodes_of_a_tree() -> None:
    rng = np.random.default_rng(0)
    tree = Tree(START)
    parents = [-1]
    for _ in range(300):  # more than the array's first size
        parent = int(rng.integers(len(tree)))
        node = np.concatenate([rng.uniform(-3, 3, 3), [0, 0, 0, 1]])
        assert tree.add(node, parent) == len(parents)
        parents.append(parent)
    assert len(tree) == 301
    nodes = np.array([tree[i] for i in range(len(tree))])
    target = np.concatenate([rng.uniform(-3, 3, 3), [0, 0, 0, 1]])
    assert tree.nearest(target) == int(np.argmin(distance(nodes, target)))
    branch = tree.branch(300)
    assert np.array_equal(branch[0], START)
    assert np.array_equal(branch[-1], tree[300])
    wanted, i = [], 300
    while i >= 0:
        wanted.append(nodes[i])
        i = parents[i]
    assert np.array_equal(branch, wanted[::-1])
