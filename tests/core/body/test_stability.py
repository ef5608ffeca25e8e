"""The robustness of contact sets, with weight and without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import MIN_CLOSURE, Stability
from rbprm_core.statics import cone_generators

DOWN = np.array([0.0, 0.0, -9.81])
MASS = 10.0


def foot_at(limb: int, x: float, y: float) -> Contact:
    position = np.array([x, y, 0.0])
    generators = cone_generators(np.eye(3), 0.5)[None]
    return Contact(limb, position, np.eye(3), position[None], generators, 0.5, "ground")


FEET = [foot_at(0, 0.3, 0.2), foot_at(1, 0.3, -0.2), foot_at(2, -0.3, 0.0)]


def test_contacts_around_the_centre_of_mass_hold_it() -> None:
    stability = Stability(MASS, DOWN, 10.0, 2.0)
    inside = stability.b0(FEET, np.array([0.05, 0.0, 0.5]))
    assert 2.0 < inside < MASS * 9.81 / 12  # 12 rays bear the weight
    assert stability.b0(FEET, np.array([1.0, 0.0, 0.5])) < 0
    assert stability.b0([], np.zeros(3)) == -np.inf
    assert (stability.min_equilibrium, stability.min_robustness) == (0.0, 2.0)


def test_without_weight_contacts_have_to_squeeze() -> None:
    stability = Stability(MASS, np.zeros(3), 10.0, 0.0)
    assert (
        stability.min_robustness == stability.min_equilibrium == pytest.approx(MIN_CLOSURE * 10.0)
    )
    assert (
        stability.b0(FEET, np.zeros(3)) < stability.min_equilibrium
    )  # they push to one side alone
    flipped = np.diag([1.0, -1.0, -1.0])
    down = cone_generators(flipped, 0.5)[None]
    lift = np.array([0.0, 0.0, 0.1])
    above = [
        replace(foot, points=foot.points + lift, rotation=flipped, generators=down) for foot in FEET
    ]
    assert stability.b0([*FEET, *above], np.array([9.0, 9.0, 9.0])) > stability.min_equilibrium


def test_a_higher_threshold_stands_without_weight_too() -> None:
    assert Stability(MASS, np.zeros(3), 10.0, 0.5).min_robustness == 0.5
