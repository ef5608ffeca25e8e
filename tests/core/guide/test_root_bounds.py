"""Root bounds for requests that give none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbprm_core.guide.root_bounds import BoundsRule, derived_bounds
from rbprm_core.placement import Placement
from rbprm_core.scene import make_surface

SQUARE = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]
UPRIGHT = Placement.parse((0, 0, 0))


def turned(*rotation: float) -> Placement:
    """Placement at x = 1 m with a rotation vector in radians."""
    angle = math.hypot(*rotation)
    axis = np.array(rotation) / angle
    return Placement.parse((1, 0, 0), (*(math.sin(angle / 2) * axis), math.cos(angle / 2)))


def test_all_places_and_surfaces_are_inside() -> None:
    places = [Placement.parse(p) for p in ((0, 0, 0.5), (1, -3, 0.5), (5, 0, 0.6), (1, 1, 1.2))]
    bounds = derived_bounds(places, [make_surface("g", SQUARE, 0.5)], BoundsRule(margin=0.5))
    assert bounds.low.tolist() == [-0.5, -3.5, -0.5]
    assert bounds.high.tolist() == [5.5, 2.5, 1.7]
    assert bounds.half_ranges.tolist() == [0.4, 0.3, 0.3]


@pytest.mark.parametrize(
    ("rotation", "wanted"),
    [
        ((0, 0, 0.6), [0.6, 0.3, 0.3]),
        ((0, 0, -0.6), [0.6, 0.3, 0.3]),
        ((0, 0.5, 0), [0.4, 0.5, 0.3]),
        ((-0.7, 0, 0), [0.4, 0.3, 0.7]),
    ],
)
@pytest.mark.parametrize("last", [False, True])
def test_any_of_the_places_may_be_turned(
    rotation: tuple[float, float, float], wanted: list[float], last: bool
) -> None:
    places = [UPRIGHT, UPRIGHT, turned(*rotation)][:: 1 if last else -1]
    bounds = derived_bounds(places, (), BoundsRule())
    assert bounds.half_ranges == pytest.approx(wanted)
