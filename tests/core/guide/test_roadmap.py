"""The roadmap's bookkeeping, its doubts, and the store that keeps it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rbprm_core.guide.roadmap import roadmap_key
from rbprm_core.guide.root import GuideOptions, Roadmap, RoadmapStore, RootBounds, RootSpace
from rbprm_core.guide.root_space import distance
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, make_surface

Array = NDArray[np.float64]
DOWN = np.array([0, 0, -9.81])


def at(x: float, y: float = 0.0) -> Array:
    return np.array([x, y, 0.1, 0, 0, 0, 1])


def tile(name: str, x: float, z: float = 0.0) -> object:
    return make_surface(name, [[x, 0, z], [x + 1, 0, z], [x + 1, 1, z], [x, 1, z]], 0.5)


@pytest.fixture
def line() -> Roadmap:
    """Nodes 0 to 4 at x = 0, 2, 4, 6, 8, each joined to the next."""
    roadmap = Roadmap()
    for i in range(5):
        assert roadmap.add(at(2.0 * i), [i - 1] if i else []) == i
    return roadmap


def cost(roadmap: Roadmap, i: int, j: int) -> float:
    return float(distance(roadmap.nodes[i].root, roadmap.nodes[j].root))


def test_the_cheapest_way(line: Roadmap) -> None:
    assert line.shortest(0, 4, lambda i, j: cost(line, i, j)) == [0, 1, 2, 3, 4]
    bow = line.add(at(4, 3), [0, 4])
    assert line.shortest(0, 4, lambda i, j: cost(line, i, j)) == [0, 1, 2, 3, 4]
    shunned = {(2, 3)}
    way = line.shortest(0, 4, lambda i, j: np.inf if (i, j) in shunned else cost(line, i, j))
    assert way == [0, bow, 4]
    assert line.shortest(2, 2, lambda i, j: 1.0) == [2]


def test_parts_and_what_is_dropped(line: Roadmap) -> None:
    assert len(set(line.parts().values())) == 1
    line.drop_node(2)
    parts = line.parts()
    assert parts.keys() == {0, 1, 3, 4}
    assert parts[0] == parts[1] != parts[3] == parts[4]
    assert line.shortest(0, 4, lambda i, j: 1.0) is None
    line.drop_edge(3, 4)
    assert line.edges() == [(0, 1)]
    assert len(set(line.parts().values())) == 3
    assert line.add(at(1), [1, 3]) == 5  # numbers are not given twice


def test_only_what_is_near_a_change_is_doubted(line: Roadmap) -> None:
    scene = Scene([tile("a", 0), tile("b", 30)])
    line.open(scene, 0.3)
    assert not any(line.doubtful(i, j) for i, j in line.edges())
    line.open(scene.edited([tile("c", 4.4)]), 0.3)  # from x = 4.4 to 5.4
    assert [e for e in line.edges() if line.doubtful(*e)] == [(2, 3)]
    line.confirm(2, 3)
    line.open(scene.edited([tile("c", 4.4)]), 0.3)  # equal, if another object
    assert not any(line.doubtful(i, j) for i, j in line.edges())
    line.open(scene, 0.3)  # gone again
    assert line.doubtful(2, 3)
    assert not line.doubtful(0, 1)


def test_a_doubtful_node_casts_doubt_on_its_edges(line: Roadmap) -> None:
    scene = Scene([tile("a", 30)])
    line.open(scene, 0.3)
    line.open(scene.edited([tile("c", 3.8)]), 0.3)
    assert line.nodes[2].doubtful
    assert not line.nodes[3].doubtful
    assert [e for e in line.edges() if line.doubtful(*e)] == [(1, 2), (2, 3)]


def test_what_one_request_needed_goes_with_it(line: Roadmap) -> None:
    scene = Scene([tile("a", 0)])
    line.open(scene, 0.5)
    passing = line.add(at(1), [0], passing=True)
    line.open(scene, 0.5)
    assert passing not in line.nodes
    assert len(line) == 5
    assert line.edges() == [(0, 1), (1, 2), (2, 3), (3, 4)]


def test_a_store_keeps_the_last_ones() -> None:
    scene = Scene([tile("a", 0)])
    store = RoadmapStore(capacity=2)
    first = store.roadmap("first", scene, 1.0)
    assert store.roadmap("second", scene, 1.0) is not first
    assert store.roadmap("first", scene, 1.0) is first
    store.roadmap("third", scene, 1.0)
    assert len(store) == 2
    assert store.roadmap("first", scene, 1.0) is first  # the second was used longest ago


def test_a_key_is_of_all_that_decides_but_the_scene(hyq_data: RobotData) -> None:
    bounds = RootBounds(-np.ones(3), np.ones(3), np.ones(3))
    space = RootSpace(bounds, np.zeros(0), np.zeros(0))
    wider = RootSpace(replace(bounds, high=2 * np.ones(3)), np.zeros(0), np.zeros(0))
    options, legs = GuideOptions(), ("lf_leg", "rf_leg")
    base = roadmap_key(hyq_data, space, legs, options, DOWN)
    assert roadmap_key(hyq_data, space, legs[::-1], options, 2 * DOWN) == base
    others = [
        roadmap_key(replace(hyq_data, trunk=()), space, legs, options, DOWN),
        roadmap_key(hyq_data, wider, legs, options, DOWN),
        roadmap_key(hyq_data, space, legs[:1], options, DOWN),
        roadmap_key(hyq_data, space, legs, replace(options, resolution=0.1), DOWN),
        roadmap_key(hyq_data, space, legs, replace(options, equilibrium=True), DOWN),
        roadmap_key(hyq_data, space, legs, replace(options, equilibrium=True), 2 * DOWN),
    ]
    assert len({base, *others}) == 7
