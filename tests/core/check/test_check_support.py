"""Transitions by the ends at which the robot is stable without the moving contact."""

from __future__ import annotations

import numpy as np
import pytest

from rbprm_core.arrays import Array
from rbprm_core.check import TransitionSupport
from rbprm_core.check.transition_support import SupportCounter, TransitionEnd
from rbprm_core.plan_record import ContactEntry

WEIGHT = np.array([0.0, 0.0, -100.0])
FEET = {"lf": (1, 1, 0), "rf": (1, -1, 0), "lh": (-1, 1, 0), "rh": (-1, -1, 0)}


def foot(limb: str, x: float = 0.0) -> ContactEntry:
    """The contact of a foot of a square stance on level ground."""
    at = (FEET[limb][0] + x, FEET[limb][1], 0)
    return ContactEntry(
        limb=limb, frame=limb, type="point", position=at, orientation=(0, 0, 0, 1),
        normal=(0, 0, 1), points=(at,), friction=0.5,
    )  # fmt: skip


def stance(x: float, y: float, *limbs: str) -> TransitionEnd:
    """Stance feet on the ground with the centre of mass above (x, y)."""
    return TransitionEnd([foot(limb) for limb in limbs or FEET], np.array([x, y, 0.5]))


def total(
    before: TransitionEnd, after: TransitionEnd, *changed: str, load: Array = WEIGHT
) -> TransitionSupport:
    count = SupportCounter(load, 10.0)
    count.add(before, after, changed)
    return count.total


NEITHER, ONE, BOTH = (
    TransitionSupport(both=int(ends == 2), one=int(ends == 1), neither=int(ends == 0))
    for ends in range(3)
)


@pytest.mark.parametrize(
    ("before", "after", "wanted"),
    [
        ((-0.3, -0.3), (-0.3, -0.3), BOTH),  # over the support triangle of the other three
        ((0.3, 0.3), (0.3, 0.3), NEITHER),  # over the foot that moves
        ((0.3, 0.3), (-0.3, -0.3), ONE),
        ((-0.3, -0.3), (0.3, 0.3), ONE),
    ],
)
def test_a_foot_of_four_that_moves(
    before: tuple[float, float], after: tuple[float, float], wanted: TransitionSupport
) -> None:
    assert total(stance(*before), stance(*after), "lf") == wanted


def test_a_contact_that_breaks_or_is_made() -> None:
    three = ("rf", "lh", "rh")
    outside = stance(0.3, 0.3)
    assert total(outside, stance(-0.3, -0.3, *three), "lf") == ONE
    assert total(stance(-0.3, -0.3, *three), outside, "lf") == ONE
    assert total(stance(-0.3, -0.3), stance(-0.3, -0.3, *three), "lf") == BOTH
    assert total(stance(0, 0, "lf"), stance(0, 0, "lf"), "lf") == NEITHER  # no stance foot is left


def test_without_weight_a_grip_counts() -> None:
    """Two opposite fingers hold a pen while a third moves; one alone does not."""
    none = np.zeros(3)
    fingers = [
        ContactEntry(
            limb=name, frame=name, type="point", position=(x, 0, 0), orientation=(0, 0, 0, 1),
            normal=(np.sign(x), 0, 0), points=((x, 0, 0),), friction=0.5,
        )
        for name, x in (("a", 0.01), ("b", -0.01), ("c", 0.01))
    ]  # fmt: skip
    held = TransitionEnd(fingers, none)
    assert total(held, held, "c", load=none) == BOTH
    assert total(held, held, "b", load=none) == NEITHER


def test_shares_in_words() -> None:
    text = str(TransitionSupport(both=6, one=3, neither=1))
    assert text == "at both ends 60%, one 30%, neither 10%, without the moving contact"
    assert "0%" in str(TransitionSupport(0, 0, 0))
