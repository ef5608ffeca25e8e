"""Visibility PRM: paths around walls, roadmaps kept between requests and repaired after edits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.errors import Cancelled, NoGuideFound, TimeLimitReached
from rbprm_core.guide.root import GuidePath, PrmOptions, Roadmap, RootBounds
from rbprm_core.guide.root.prm import PrmSearch
from rbprm_core.scene import Scene, Surface, make_surface

Make = Callable[..., Any]
Box = Callable[..., list[Surface]]
START, GOAL = (np.array([x, 0, 0.6, 0, 0, 0, 1]) for x in (-2.0, 2.0))
BOUNDS = RootBounds(np.array([-3.0, -2, 0.3]), np.array([3.0, 2, 1]), np.array([0.5, 0.2, 0.2]))
GROUND = make_surface("ground", [[-4, -3, 0], [4, -3, 0], [4, 3, 0], [-4, 3, 0]], 0.5)


def wall(make_box: Box, low: float, high: float, name: str = "wall") -> list[Surface]:
    return make_box(name, np.array([-0.2, low, 0.0]), np.array([0.2, high, 2.0]))


def run(ground: Any, roadmap: Roadmap, seed: int = 0, **how: Any) -> GuidePath:
    """Path in the scene of a ground, on a roadmap opened for it."""
    roadmap.open(ground.scene, ground.condition.radius)
    options = PrmOptions(iterations=how.pop("iterations", 2000))
    search = PrmSearch(ground.problem(START, GOAL), roadmap, options)
    path, nodes = search.find(how.pop("budget", Budget()), np.random.default_rng(seed), **how)
    assert nodes >= 2
    return path


def assert_holds(ground: Any, path: GuidePath) -> None:
    assert np.array_equal(path.nodes[[0, -1]], [START, GOAL])
    for a, b in zip(path.nodes, path.nodes[1:], strict=False):
        assert ground.edges.holds(a, b) or ground.edges.holds(b, a)


@pytest.fixture
def around(make_ground: Make, make_box: Box) -> Any:
    """A wall that leaves a passage on one side."""
    return make_ground(Scene([GROUND, *wall(make_box, -3, 0.5)]), BOUNDS)


def test_an_open_way_needs_no_roadmap(make_ground: Make) -> None:
    roadmap = Roadmap()
    path = run(make_ground(Scene([GROUND]), BOUNDS), roadmap)
    assert path.length == pytest.approx(4)
    assert len(roadmap) == 0


@pytest.mark.parametrize("seed", range(4))
def test_a_way_past_a_wall(around: Any, seed: int) -> None:
    path = run(around, Roadmap(), seed)
    assert_holds(around, path)
    assert path.nodes[:, 1].max() > 0.5


def test_the_seed_decides(around: Any) -> None:
    first, again, other = (run(around, Roadmap(), seed) for seed in (5, 5, 6))
    assert np.array_equal(first.nodes, again.nodes)
    assert not np.array_equal(first.nodes, other.nodes)


def test_guards_do_not_see_each_other_and_connectors_join(around: Any) -> None:
    roadmap = Roadmap()
    run(around, roadmap)
    linked = {frozenset(edge) for edge in roadmap.edges()}
    for i, j in linked:
        a, b = roadmap.nodes[i].root, roadmap.nodes[j].root
        assert around.edges.holds(a, b) or around.edges.holds(b, a)
    degree = dict.fromkeys(roadmap.nodes, 0)
    for edge in linked:
        for i in edge:
            degree[i] += 1
    assert max(degree.values()) >= 2  # a connector, unless start and goal see no common guard
    assert len(roadmap) < 30


def test_a_search_without_the_direct_try_gives_another_path(around: Any) -> None:
    first = run(around, Roadmap(), 1)
    search = PrmSearch(around.problem(START, GOAL), Roadmap(), PrmOptions())
    rng = np.random.default_rng(1)
    paths = [search.find(Budget(), rng, direct=direct)[0] for direct in (True, *5 * [False])]
    assert np.array_equal(paths[0].nodes, first.nodes)
    for path in paths:
        assert_holds(around, path)
    assert len({path.nodes.tobytes() for path in paths}) > 1


def test_the_straight_way_is_not_taken_twice(make_ground: Make) -> None:
    ground = make_ground(Scene([GROUND]), BOUNDS)
    path = run(ground, Roadmap(), direct=False)
    assert_holds(ground, path)
    assert len(path.nodes) > 2


def test_what_is_avoided_is_passed_by(make_ground: Make, make_box: Box) -> None:
    ground = make_ground(Scene([GROUND, *wall(make_box, -3, 0.5)]), BOUNDS)
    search = PrmSearch(ground.problem(START, GOAL), Roadmap(), PrmOptions())
    rng = np.random.default_rng(3)
    path, _ = search.find(Budget(), rng)
    for _ in range(3):
        stopped = path.root(path.length / 2)
        ground.condition.avoid(stopped, keep=(START, GOAL))
        path, _ = search.find(Budget(), rng, direct=False)
        assert not ground.condition.avoids(path.nodes)
        for a, b in zip(path.nodes, path.nodes[1:], strict=False):
            assert not ground.edges.avoids(a, b)


def test_no_way_over_a_gap(make_ground: Make) -> None:
    sides = [
        make_surface(n, [[a, -3, 0], [b, -3, 0], [b, 3, 0], [a, 3, 0]], 0.5)
        for n, a, b in (("a", -4, -1.5), ("b", 1.5, 4))
    ]
    gap = make_ground(Scene(sides), BOUNDS)
    with pytest.raises(NoGuideFound, match="40 samples did not connect") as caught:
        run(gap, Roadmap(), iterations=40)
    assert caught.value.nodes >= 2
    with pytest.raises(TimeLimitReached, match="guide"):
        run(gap, Roadmap(), iterations=10**9, budget=Budget(0.2))
    answers = iter([False] * 20)
    with pytest.raises(Cancelled, match="guide"):
        run(gap, Roadmap(), iterations=10**9, budget=Budget(cancelled=lambda: next(answers, True)))


class Counted:
    """Counts tested edges."""

    def __init__(self, ground: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        self.count, holds = 0, ground.edges.holds

        def counted(a: Array, b: Array) -> bool:
            self.count += 1
            return bool(holds(a, b))

        monkeypatch.setattr(ground.edges, "holds", counted)


def test_a_kept_roadmap_answers_at_once(around: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    roadmap = Roadmap()
    first = Counted(around, monkeypatch)
    run(around, roadmap)
    work, size = first.count, len(roadmap)
    second = Counted(around, monkeypatch)
    path = run(around, roadmap, seed=1)
    assert_holds(around, path)
    assert second.count < work
    for seed in range(2, 12):
        run(around, roadmap, seed)
    assert len(roadmap) <= size + 2  # nodes of earlier requests are removed


def test_an_edit_far_away_leaves_all_edges_verified(around: Any, make_box: Box) -> None:
    roadmap = Roadmap()
    run(around, roadmap)
    far = make_box("far", np.array([20.0, 20, 0]), np.array([21.0, 21, 1]))
    roadmap.open(around.scene.edited(far), around.condition.radius)
    assert roadmap.edges()
    assert not any(roadmap.unverified(i, j) for i, j in roadmap.edges())


def test_a_wall_put_in_the_way_is_gone_around(
    around: Any, make_ground: Make, make_box: Box
) -> None:
    """The passage of the first path is closed, another is opened."""
    roadmap = Roadmap()
    first = run(around, roadmap)
    assert first.nodes[:, 1].max() > 0.5
    moved = make_ground(around.scene.edited(wall(make_box, -0.5, 3)), BOUNDS)
    second = run(moved, roadmap)
    assert_holds(moved, second)
    assert second.nodes[:, 1].min() < -0.5
    back = make_ground(moved.scene.edited(wall(make_box, -3, 0.5)), BOUNDS)
    assert_holds(back, run(back, roadmap))


def test_ground_that_is_taken_away_is_no_longer_walked_on(make_ground: Make) -> None:
    """Two strips of ground side by side; the one that the first path uses is removed."""
    ends = [
        make_surface(n, [[a, -2, 0], [b, -2, 0], [b, 2, 0], [a, 2, 0]], 0.5)
        for n, a, b in (("here", -4, -1), ("there", 1, 4))
    ]
    strips = [
        make_surface(n, [[-1, y, 0], [1, y, 0], [1, y + 1, 0], [-1, y + 1, 0]], 0.5)
        for n, y in (("left", 0.5), ("right", -1.5))
    ]
    both = make_ground(Scene([*ends, *strips]), BOUNDS)
    roadmap = Roadmap()
    first = run(both, roadmap)
    used = "left" if first.nodes[np.argmin(np.abs(first.nodes[:, 0])), 1] > 0 else "right"
    one = make_ground(both.scene.edited(removed=[used]), BOUNDS)
    second = run(one, roadmap)
    assert_holds(one, second)
    none = make_ground(one.scene.edited(removed=[{"left": "right", "right": "left"}[used]]), BOUNDS)
    with pytest.raises(NoGuideFound):
        run(none, roadmap, iterations=20)
