"""The order of limbs and contacts that follows from the states before."""

from __future__ import annotations

import pytest

from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide.walk_state import WalkState, walk_state
from rbprm_core.outcome import Outcome
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

Planned = tuple[RobotData, Scene, PlanRequest, Outcome]


@pytest.mark.parametrize("reverse", [False, True], ids=["as planned", "contacts reversed"])
def test_the_order_from_history_is_that_of_the_planned_sequence(
    trot: Planned, reverse: bool
) -> None:
    """HyQ on flat ground; after the first state the order of the given contacts does not count."""
    data, _, _, outcome = trot
    plain = [plain_state(s, reverse and i > 0) for i, s in enumerate(outcome.states)]
    limbs = len(data.robot.limbs)
    for i, planned in enumerate(outcome.states):
        assert isinstance(planned, WalkState)
        found = walk_state(plain[: i + 1], limbs)
        assert found.free == planned.free
        assert [id(c) for c in found.contacts] == [id(c) for c in planned.contacts]
        assert found.q is planned.q
        assert found.robustness == planned.robustness
    assert len(outcome.states) > 10


def plain_state(state: State, reverse: bool) -> State:
    """The state without the order of its free limbs."""
    contacts = state.contacts[::-1] if reverse else state.contacts
    return State(state.q, contacts, state.com, state.robustness)


def test_in_the_first_state_free_limbs_are_in_the_order_of_the_robot(trot: Planned) -> None:
    first = trot[3].states[0]
    one = State(first.q, first.contacts[2:3], first.com, first.robustness)
    held = first.contacts[2].limb
    assert walk_state([one], 4).free == tuple(k for k in range(4) if k != held)
    whole = walk_state([State(first.q, first.contacts, first.com, 1.0)], 4)
    assert whole.contacts == first.contacts
    assert whole.free == ()


def test_the_limb_that_is_free_for_the_longest_time_comes_first(trot: Planned) -> None:
    first = trot[3].states[0]
    contact = {c.limb: c for c in first.contacts}

    def on(*limbs: int) -> State:
        return State(first.q, tuple(contact[k] for k in limbs), first.com, first.robustness)

    assert walk_state([on(0, 1, 2, 3), on(0, 1, 2), on(1, 2)], 4).free == (3, 0)
    made = walk_state([on(0, 1, 2, 3), on(1, 2, 3), on(0, 1, 2, 3)], 4)
    assert [c.limb for c in made.contacts] == [1, 2, 3, 0]
    assert made.free == ()
