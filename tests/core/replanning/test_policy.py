"""The policy: the plan stands, is planned anew from a good state, or nothing can be done."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.errors import InvalidInput
from rbprm_core.failures import Cause, Failure
from rbprm_core.replanning.policy import Keep, Replan, Situation, Stuck, decide


@st.composite
def situations(draw: st.DrawFn) -> Situation:
    states = draw(st.integers(1, 200))
    return Situation(
        states=states,
        executed=draw(st.integers(-1, states - 1)),
        invalid=tuple(draw(st.lists(st.integers(0, states - 1), max_size=20))),
        complete=draw(st.booleans()),
    )


@given(situations())
def test_what_is_over_never_counts(given_: Situation) -> None:
    executed = max(given_.executed, 0)
    ahead = tuple(i for i in given_.invalid if i >= executed)
    assert decide(given_) == decide(Situation(given_.states, executed, ahead, given_.complete))


@given(situations())
def test_it_goes_on_from_states_that_hold_and_are_not_over(given_: Situation) -> None:
    executed = max(given_.executed, 0)
    ahead = [i for i in given_.invalid if i >= executed]
    decision = decide(given_)
    if executed in ahead:
        assert isinstance(decision, Stuck)
    elif ahead or not given_.complete:
        assert isinstance(decision, Replan)
        chosen = decision.candidates
        last = min(ahead) - 1 if ahead else given_.states - 1
        assert chosen[0] == last
        assert chosen[-1] == executed
        assert list(chosen) == sorted(set(chosen), reverse=True)
        assert not set(chosen) & set(ahead)
        assert len(chosen) <= 2 + given_.states.bit_length()
    else:
        assert decision == Keep()


def test_a_sequence_that_is_whole_and_holds_stands() -> None:
    assert decide(Situation(40, 12)) == Keep()
    assert decide(Situation(40, 12, (3, 11))) == Keep()


def test_the_way_back_is_halved() -> None:
    assert decide(Situation(40, 4, (21, 30))) == Replan((20, 12, 8, 6, 5, 4))
    assert decide(Situation(40, -1, (1,))) == Replan((0,))


def test_a_robot_that_stands_on_nothing_is_stuck() -> None:
    decision = decide(Situation(40, 7, (7, 8)))
    assert isinstance(decision, Stuck)
    assert decision.failure == Failure.of(Cause.EXECUTED_STATE_INVALID, state=7)


def test_what_is_left_of_a_failed_plan_is_planned_on_when_surfaces_change() -> None:
    assert decide(Situation(10, 6, complete=False)) == Replan((9, 7, 6))
    assert decide(Situation(10, 6, (8,), complete=False)) == Replan((7, 6))


def test_no_sequence_needs_no_decision() -> None:
    assert decide(Situation(0)) == Keep()


@pytest.mark.parametrize(
    ("situation", "field"),
    [
        (Situation(5, 5), "executed"),
        (Situation(5, -2), "executed"),
        (Situation(0, 0), "executed"),
        (Situation(5, 0, (5,)), "invalid"),
        (Situation(5, 0, (-1,)), "invalid"),
    ],
)
def test_indices_that_no_state_has_are_refused(situation: Situation, field: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        decide(situation)
    assert caught.value.field == field
