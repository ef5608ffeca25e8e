"""Differences between two scenes."""

from __future__ import annotations

import numpy as np
import pytest

from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.scene.changes import changed_boxes


def tile(name: str, x: float, friction: float = 0.5) -> Surface:
    return make_surface(name, [[x, 0, 0], [x + 1, 0, 0], [x + 1, 1, 0], [x, 1, 0]], friction)


SCENE = Scene([tile("a", 0), tile("b", 2)], np.array([[[9, 9, 0], [9, 10, 0], [10, 9, 0.0]]]))


def test_nothing_changed() -> None:
    assert changed_boxes(SCENE, SCENE).shape == (0, 2, 3)
    twin = Scene([tile("b", 2), tile("a", 0)], SCENE.obstacles.copy())
    assert changed_boxes(SCENE, twin).shape == (0, 2, 3)


@pytest.mark.parametrize("forth", [True, False])
def test_added_or_removed(forth: bool) -> None:
    scenes = (SCENE, SCENE.edited([tile("c", 5)]))
    boxes = changed_boxes(*(scenes if forth else scenes[::-1]))
    assert boxes == pytest.approx(np.array([[[5, 0, 0], [6, 1, 0]]]))


def test_a_moved_surface_changes_both_places() -> None:
    boxes = changed_boxes(SCENE, SCENE.edited([tile("b", 3)]))
    assert sorted(boxes[:, 0, 0]) == [2, 3]


def test_friction_is_a_change_and_so_is_a_hole() -> None:
    assert len(changed_boxes(SCENE, SCENE.edited([tile("b", 2, friction=0.3)]))) == 2
    ring = tile("b", 2).polygon.boundary
    hole = np.array([[2.4, 0.4, 0], [2.4, 0.6, 0], [2.6, 0.6, 0], [2.6, 0.4, 0]])
    assert len(changed_boxes(SCENE, SCENE.edited([make_surface("b", ring, 0.5, (hole,))]))) == 2


def test_obstacles_triangle_by_triangle() -> None:
    more = np.concatenate([SCENE.obstacles, SCENE.obstacles + 5])
    boxes = changed_boxes(SCENE, Scene(SCENE.surfaces, more))
    assert boxes == pytest.approx(np.array([[[14, 14, 5], [15, 15, 5]]]))
