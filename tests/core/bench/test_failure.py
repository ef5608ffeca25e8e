"""From errors to causes."""

from __future__ import annotations

import pytest

from rbprm_core.bench.failure import failure_of, failure_of_check, group
from rbprm_core.bench.record import INVALID_PLAN, Failure
from rbprm_core.check import Kind, Violation
from rbprm_core.errors import (
    GoalUnreachable,
    InvalidInput,
    NoGuideFound,
    NoSequenceFound,
    RbprmError,
    StartUnreachable,
    TimeLimitReached,
)

STUCK = NoSequenceFound(7, "lf_leg", "finds no contact (kinematics)", 0.4)


@pytest.mark.parametrize(
    ("error", "failure"),
    [
        (STUCK, Failure("NO_SEQUENCE", "lf_leg", "finds no contact (kinematics)")),
        (StartUnreachable("no floor", "rf"), Failure("START_UNREACHABLE", "rf", "no floor")),
        (GoalUnreachable("no floor"), Failure("GOAL_UNREACHABLE", "", "no floor")),
        (NoGuideFound("closed"), Failure("NO_GUIDE", "", "closed")),
        (TimeLimitReached(3.0, "guide"), Failure("TIME_LIMIT", "", "in stage guide")),
        (
            TimeLimitReached(3.0, "guide", STUCK),
            Failure(
                "TIME_LIMIT", "lf_leg", "in stage guide, before: finds no contact (kinematics)"
            ),
        ),
        (InvalidInput("start", 1, "bad"), Failure("INVALID_INPUT", "", "start: bad")),
        (RbprmError("odd"), Failure("INTERNAL", "", "odd")),
        (IndexError("no row 3"), Failure("INTERNAL", "", "IndexError: no row 3")),
    ],
)
def test_every_error_keeps_its_limb_and_reason(error: Exception, failure: Failure) -> None:
    assert failure_of(error) == failure


def test_the_check_blames_the_first_violation_and_names_every_kind() -> None:
    violations = [
        Violation(3, "lf_leg", Kind.DRIFT, "…"),
        Violation(4, "rf_leg", Kind.DRIFT, "…"),
        Violation(9, "", Kind.GOAL, "…"),
    ]
    assert failure_of_check(violations) == Failure(INVALID_PLAN, "lf_leg", "drift, goal")
    assert failure_of_check([]) is None


@pytest.mark.parametrize(
    ("reason", "grouped"),
    [
        ("b0 -3.2e-05 N under 10 N", "b0 … N under … N"),
        ("limb L2 at 0.5", "limb L2 at …"),
        ("4 nodes, 12 of 2000", "… nodes, … of …"),
    ],
)
def test_grouping_drops_numbers_but_not_names(reason: str, grouped: str) -> None:
    assert group(Failure("X", "", reason)).reason == grouped
