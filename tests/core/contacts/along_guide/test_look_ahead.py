"""What lies ahead on a guide: the direction of motion is the local one, at corners and ends too."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.guide.root import GuidePath

Array = NDArray[np.float64]

STEP, SPAN = 0.1, 0.4
X, Y = np.eye(3)[:2]


def root(x: float, y: float, yaw: float = 0.0) -> Array:
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, yaw)).coeffs()
    return np.concatenate([[x, y, 0.5], turn])


def direction(guide: GuidePath, mark: float) -> Array:
    return LookAhead.along(guide, mark, SPAN, STEP).direction


CORNER = GuidePath(np.array([root(0, 0), root(1, 0), root(1, 1)]))


@pytest.mark.parametrize(
    ("mark", "wanted"),
    [
        (0.0, X),
        (0.7, X),  # the corner is in sight, but the next root is not round it
        (0.95, (X + Y) / np.sqrt(2)),  # the next root is as far behind it as this one before
        (1.0, Y),
        (1.95, Y),
        (2.0, Y),  # at the goal: the way it came
    ],
)
def test_the_direction_is_that_of_two_consecutive_roots(mark: float, wanted: Array) -> None:
    assert direction(CORNER, mark) == pytest.approx(wanted, abs=1e-9)


def test_a_root_that_only_turns_or_rests_has_no_direction() -> None:
    turning = GuidePath(np.array([root(0, 0), root(0, 0, 0.8), root(0, 1, 0.8)]))
    assert direction(turning, 0.0) == pytest.approx(np.zeros(3))
    assert direction(turning, turning.length) == pytest.approx(Y)
    assert direction(GuidePath(root(0, 0)[None]), 0.0) == pytest.approx(np.zeros(3))


def test_a_guide_shorter_than_a_step() -> None:
    short = GuidePath(np.array([root(0, 0), root(0, 0.03)]))
    for mark in (0.0, 0.02, 0.03):
        assert direction(short, mark) == pytest.approx(Y)


def test_roots_ahead_end_at_the_goal() -> None:
    ahead = LookAhead.along(CORNER, 1.8, SPAN, STEP)
    assert ahead.root == pytest.approx(root(1, 0.8))
    assert ahead.roots[0] == pytest.approx(root(1, 0.85))
    assert ahead.roots[-1] == pytest.approx(root(1, 1))
    assert len(LookAhead.still(root(0, 0)).roots) == 0
