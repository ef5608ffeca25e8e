"""Roadmap: graph operations, verification after changes of the scene, and the store."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbprm_core.arrays import Array
from rbprm_core.guide.roadmap import roadmap_key
from rbprm_core.guide.root import GuideOptions, Roadmap, RoadmapStore, RootBounds, RootSpace
from rbprm_core.guide.root_space import distance
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, make_surface

DOWN = np.array([0, 0, -9.81])


def at(x: float, y: float = 0.0) -> Array:
    return np.array([x, y, 0.1, 0, 0, 0, 1])


def tile(name: str, x: float, z: float = 0.0) -> object:
    return make_surface(name, [[x, 0, z], [x + 1, 0, z], [x + 1, 1, z], [x, 1, z]], 0.5)


@pytest.fixture
def line() -> Roadmap:
    """Nodes 0 to 4 at x = 0, 2, 4, 6 and 8 m, each connected to the next."""
    roadmap = Roadmap()
    for i in range(5):
        assert roadmap.add(at(2.0 * i), [i - 1] if i else []) == i
    return roadmap


def cost(roadmap: Roadmap, i: int, j: int) -> float:
    return float(distance(roadmap.nodes[i].root, roadmap.nodes[j].root))


def test_the_cheapest_path(line: Roadmap) -> None:
    assert line.shortest(0, 4, lambda i, j: cost(line, i, j)) == [0, 1, 2, 3, 4]
    bow = line.add(at(4, 3), [0, 4])
    assert line.shortest(0, 4, lambda i, j: cost(line, i, j)) == [0, 1, 2, 3, 4]
    excluded = {(2, 3)}
    path = line.shortest(0, 4, lambda i, j: np.inf if (i, j) in excluded else cost(line, i, j))
    assert path == [0, bow, 4]
    assert line.shortest(2, 2, lambda i, j: 1.0) == [2]


def test_components_and_removals(line: Roadmap) -> None:
    assert len(set(line.components().values())) == 1
    line.remove_node(2)
    components = line.components()
    assert components.keys() == {0, 1, 3, 4}
    assert components[0] == components[1] != components[3] == components[4]
    assert line.shortest(0, 4, lambda i, j: 1.0) is None
    line.remove_edge(3, 4)
    assert line.edges() == [(0, 1)]
    assert len(set(line.components().values())) == 3
    assert line.add(at(1), [1, 3]) == 5  # numbers are never reused


def test_only_edges_near_a_change_become_unverified(line: Roadmap) -> None:
    scene = Scene([tile("a", 0), tile("b", 30)])
    line.open(scene, 0.3)
    assert not any(line.unverified(i, j) for i, j in line.edges())
    line.open(scene.edited([tile("c", 4.4)]), 0.3)  # from x = 4.4 to 5.4
    assert [e for e in line.edges() if line.unverified(*e)] == [(2, 3)]
    line.confirm(2, 3)
    line.open(scene.edited([tile("c", 4.4)]), 0.3)  # an equal surface, though another object
    assert not any(line.unverified(i, j) for i, j in line.edges())
    line.open(scene, 0.3)  # gone again
    assert line.unverified(2, 3)
    assert not line.unverified(0, 1)


def test_edges_of_an_unverified_node_are_unverified(line: Roadmap) -> None:
    scene = Scene([tile("a", 30)])
    line.open(scene, 0.3)
    line.open(scene.edited([tile("c", 3.8)]), 0.3)
    assert line.nodes[2].unverified
    assert not line.nodes[3].unverified
    assert [e for e in line.edges() if line.unverified(*e)] == [(1, 2), (2, 3)]


def test_temporary_nodes_go_with_their_request(line: Roadmap) -> None:
    scene = Scene([tile("a", 0)])
    line.open(scene, 0.5)
    temporary = line.add(at(1), [0], temporary=True)
    line.open(scene, 0.5)
    assert temporary not in line.nodes
    assert len(line) == 5
    assert line.edges() == [(0, 1), (1, 2), (2, 3), (3, 4)]


def test_a_store_keeps_the_latest_roadmaps() -> None:
    scene = Scene([tile("a", 0)])
    store = RoadmapStore(capacity=2)
    first = store.roadmap("first", scene, 1.0)
    assert store.roadmap("second", scene, 1.0) is not first
    assert store.roadmap("first", scene, 1.0) is first
    store.roadmap("third", scene, 1.0)
    assert len(store) == 2
    assert store.roadmap("first", scene, 1.0) is first  # the second was used longest ago


def test_the_key_depends_on_all_that_decides_validity_but_the_scene(hyq_data: RobotData) -> None:
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
