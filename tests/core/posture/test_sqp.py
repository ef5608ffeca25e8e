"""The solver on programs that have nothing to do with robots."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from rbprm_core.arrays import Array
from rbprm_core.posture.sqp import Linearisation, SqpOptions, TrustRegion, minimise


@dataclass
class Circle:
    """The point of a circle nearest to a target; points above a height are found out late.

    Attributes:
        target: (2,) target.
        radius: radius of the circle about the origin.
        height: largest second coordinate, a constraint that `accepts` holds back.
        distant: radius of a second circle that contradicts the first, 0 for none.
    """

    target: Array
    radius: float = 1.0
    height: float = np.inf
    distant: float = 0.0
    limited: bool = field(default=False, init=False)
    linearised: int = field(default=0, init=False)

    def linearise(self, point: Array) -> Linearisation:
        self.linearised += 1
        radii = [self.radius, *([self.distant] if self.distant else [])]
        matrix = [2 * point for _ in radii]
        lower = [radius**2 - float(point @ point) for radius in radii]
        upper = list(lower)
        if self.limited:
            matrix.append(np.array([0.0, 1.0]))
            lower.append(-np.inf)
            upper.append(self.height - point[1])
        bounds = np.array(lower), np.array(upper)
        violation = max(bounds[0].max(), -bounds[1].min())
        return Linearisation(
            np.array(matrix), *bounds, np.full(2, -np.inf), np.full(2, np.inf),
            point - self.target, np.eye(2), violation / 1e-8,
        )  # fmt: skip

    def moved(self, point: Array, step: Array) -> Array:
        return point + step

    def accepts(self, point: Array) -> bool:
        held = point[1] <= self.height + 1e-6
        self.limited |= not held
        return bool(held)


def test_it_finds_a_point_that_satisfies_the_constraints() -> None:
    found = minimise(Circle(np.array([0.75, 1.0])), np.array([1.2, 0.1]), SqpOptions())
    assert found.solved
    assert np.linalg.norm(found.point) == pytest.approx(1.0, abs=1e-7)
    assert 0 < found.steps < 16


def test_more_steps_reduce_the_criterion() -> None:
    options = SqpOptions(criterion_steps=50)
    found = minimise(Circle(np.array([0.75, 1.0])), np.array([2.0, 0.1]), options)
    assert found.point == pytest.approx([0.6, 0.8], abs=1e-3)


def test_a_constraint_that_was_held_back_is_satisfied_in_the_end() -> None:
    circle = Circle(np.array([0.75, 1.0]), height=0.3)
    found = minimise(circle, np.array([1.2, 0.5]), SqpOptions())
    assert circle.limited
    assert found.solved
    assert found.point[1] <= 0.3 + 1e-6


def test_it_stops_early_where_constraints_contradict_each_other() -> None:
    circle = Circle(np.zeros(2), distant=2.0)
    options = SqpOptions(max_steps=100)
    found = minimise(circle, np.array([1.0, 1.0]), options)
    assert not found.solved
    assert circle.linearised < 20


def test_the_trust_region_shrinks_where_the_distance_grows() -> None:
    region = TrustRegion(SqpOptions(max_step=0.4))
    radii = []
    for distance in (1.0, 2.0, 3.0, 1.0, 0.5, 0.2):
        region.update(distance)
        radii.append(region.radius)
    assert radii == [0.4, 0.2, 0.1, 0.2, 0.4, 0.4]
    assert not region.stalls
    for _ in range(4):
        region.update(0.2)
    assert region.stalls
