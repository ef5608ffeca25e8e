"""The change of contacts between neighbouring states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.transition import SAME_CONTACT, Action, Transition, is_kept
from rbprm_core.statics import cone_generators


def contact(limb: int, x: float = 0.0) -> Contact:
    position = np.array([x, 0.1 * limb, 0.0])
    generators = cone_generators(np.eye(3), 0.5)[None]
    return Contact(limb, position, np.eye(3), position[None], generators, 0.5, "ground")


def state(*contacts: Contact) -> State:
    return State(np.zeros(7), contacts, np.zeros(3), 1.0)


FEET = [contact(limb) for limb in range(4)]


def test_no_change() -> None:
    before, after = state(*FEET), state(*FEET[::-1])
    found = Transition.between(before, after)
    assert found.before is before
    assert found.after is after
    assert found.changes == ()
    assert (found.action, found.moving_limb) == (Action.NONE, None)
    assert found.shared_contacts == tuple(FEET)


@pytest.mark.parametrize("limb", range(4))
@pytest.mark.parametrize("action", [Action.MAKE, Action.BREAK, Action.MOVE])
def test_one_change(action: Action, limb: int) -> None:
    others = [foot for foot in FEET if foot.limb != limb]
    old = None if action is Action.MAKE else FEET[limb]
    new = None if action is Action.BREAK else contact(limb, 0.2)
    before = state(*others) if old is None else state(*FEET)
    after = state(*others) if new is None else state(*others, new)
    found = Transition.between(before, after)
    (change,) = found.changes
    assert (change.limb, change.action) == (limb, action)
    assert change.before is old
    assert change.after is new
    assert (found.action, found.moving_limb) == (action, limb)
    assert found.shared_contacts == tuple(others)


def test_two_changes_are_in_the_order_of_the_limbs() -> None:
    moved = contact(2, 0.3)
    found = Transition.between(state(FEET[3], FEET[2], FEET[0]), state(FEET[0], moved))
    assert [(c.limb, c.action) for c in found.changes] == [(2, Action.MOVE), (3, Action.BREAK)]
    assert (found.action, found.moving_limb) == (Action.MOVE, 2)
    assert found.shared_contacts == (FEET[0],)


@pytest.mark.parametrize(("shift", "kept"), [(0.9, True), (1.1, False)])
def test_a_contact_that_hardly_moved_is_kept(shift: float, kept: bool) -> None:
    old = FEET[1]
    new = replace(old, position=old.position + np.array([0.0, 0.0, shift * SAME_CONTACT]))
    assert is_kept(old, new) is kept
    found = Transition.between(state(old), state(new))
    assert found.action is (Action.NONE if kept else Action.MOVE)


def test_a_free_limb_keeps_no_contact() -> None:
    assert is_kept(FEET[0], FEET[0])
    assert not is_kept(FEET[0], None)
    assert not is_kept(None, FEET[0])
    assert not is_kept(None, None)


def test_the_actions_are_those_of_plan_files() -> None:
    assert [action.value for action in Action] == ["none", "make", "break", "move"]
