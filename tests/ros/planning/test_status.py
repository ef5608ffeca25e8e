"""The status table, enumerated over all facts."""

from __future__ import annotations

import itertools

import pytest

from rbprm_core.errors import ErrorCode
from rbprm_ros.errors import NO_ERROR, ErrorData
from rbprm_ros.planning.status import STATUS_TABLE, Activity, Facts, Validity, status_of

CALL = ErrorData(ErrorCode.NO_GUIDE, "the call failed")
SEQUENCE = ErrorData(ErrorCode.START_UNREACHABLE, "the sequence cannot be replanned")

ALL = [
    Facts(*flags, validity, is_news, call, SEQUENCE if validity is Validity.FAILED else NO_ERROR)
    for *flags, validity, is_news, call in itertools.product(
        *[(False, True)] * 4, Validity, (False, True), (NO_ERROR, CALL)
    )
]

IDLE = {Validity.UNKNOWN: Activity.IDLE}
NEW = {Validity.PLANNED: Activity.PLANNING, Validity.REPLANNED: Activity.REPLANNING}
VALID = {Validity.VALID: Activity.VALID}
BAD = {Validity.INVALID: Activity.INVALIDATED, Validity.FAILED: Activity.FAILED}


def expected(facts: Facts) -> tuple[Activity, ErrorData]:
    """Activity and error, written a second time as nested decisions."""
    error = facts.call_error if facts.call_failed else facts.sequence_error
    if not facts.active:
        return Activity.IDLE, error
    if facts.planning:
        if facts.published and facts.is_news:
            if facts.replanning:
                return Activity.REPLANNING, error
            if facts.validity in BAD:
                return BAD[facts.validity], error
        return Activity.PLANNING, NO_ERROR
    if not facts.published:
        return (Activity.FAILED if facts.call_failed else Activity.IDLE), error
    if facts.replanning:
        return Activity.REPLANNING, error
    return (IDLE | NEW | VALID | BAD)[facts.validity], error


def test_all_facts_are_enumerated() -> None:
    assert len(ALL) == len(set(ALL)) == 2**4 * len(Validity) * 2 * 2


@pytest.mark.parametrize("active", [False, True])
@pytest.mark.parametrize("planning", [False, True])
@pytest.mark.parametrize("published", [False, True])
@pytest.mark.parametrize("replanning", [False, True])
def test_every_combination_of_facts_has_its_status(
    active: bool, planning: bool, published: bool, replanning: bool
) -> None:
    for facts in ALL:
        flags = (facts.active, facts.planning, facts.published, facts.replanning)
        if flags == (active, planning, published, replanning):
            assert status_of(facts) == expected(facts), facts


def test_every_row_decides_some_combination() -> None:
    deciding = {id(next(row for row in STATUS_TABLE if row.holds(facts))) for facts in ALL}
    assert deciding == {id(row) for row in STATUS_TABLE}


def test_valid_is_only_what_was_validated_and_is_left_alone() -> None:
    for facts in ALL:
        if status_of(facts)[0] is Activity.VALID:
            assert facts.active
            assert facts.published
            assert not facts.planning
            assert not facts.replanning
            assert facts.validity is Validity.VALID


def test_nothing_but_idle_while_the_node_is_not_active() -> None:
    assert {status_of(facts)[0] for facts in ALL if not facts.active} == {Activity.IDLE}


def test_failed_always_has_an_error() -> None:
    for facts in ALL:
        activity, error = status_of(facts)
        if activity is Activity.FAILED:
            assert error in (CALL, SEQUENCE)
