"""From errors and violations to run failures."""

from __future__ import annotations

import pytest

from rbprm_core.bench.failure import failure_of, failure_of_check
from rbprm_core.bench.record import INVALID_PLAN, RunFailure
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
from rbprm_core.failures import Cause, Failure

STUCK = NoSequenceFound(7, Failure.of(Cause.NO_KINEMATIC_SOLUTION, "lf_leg"), 0.4)
NO_GROUND = Failure.of(Cause.NO_SURFACE_IN_WORKSPACE, "rf", kinds=("support",))
ROOT = Failure.of(Cause.ROOT_COLLISION)
CLOSED = Failure.of(Cause.TREES_NOT_CONNECTED, samples=30, start_nodes=4, goal_nodes=2)


@pytest.mark.parametrize(
    ("error", "code", "cause", "limb"),
    [
        (STUCK, "NO_SEQUENCE", "no_kinematic_solution", "lf_leg"),
        (StartUnreachable(NO_GROUND), "START_UNREACHABLE", "no_surface_in_workspace", "rf"),
        (GoalUnreachable(ROOT), "GOAL_UNREACHABLE", "root_collision", ""),
        (NoGuideFound(CLOSED), "NO_GUIDE", "trees_not_connected", ""),
        (TimeLimitReached(3.0, "guide"), "TIME_LIMIT", "stage guide", ""),
        (
            TimeLimitReached(3.0, "guide", STUCK),
            "TIME_LIMIT",
            "stage guide, no_kinematic_solution",
            "lf_leg",
        ),
        (InvalidInput("start", 1, "bad"), "INVALID_INPUT", "start", ""),
        (RbprmError("odd"), "INTERNAL", "", ""),
    ],
)
def test_an_error_keeps_its_code_cause_and_limb(
    error: Exception, code: str, cause: str, limb: str
) -> None:
    assert failure_of(error) == RunFailure(code, cause, limb, str(error))


def test_an_error_of_another_package_keeps_its_type_and_text() -> None:
    expected = RunFailure("INTERNAL", "IndexError", "", "IndexError: no row 3")
    assert failure_of(IndexError("no row 3")) == expected


def test_a_refused_plan_has_the_limb_of_its_first_violation_and_every_kind() -> None:
    violations = [
        Violation(3, "lf_leg", Kind.DRIFT, "…"),
        Violation(4, "rf_leg", Kind.DRIFT, "…"),
        Violation(9, "", Kind.GOAL, "…"),
    ]
    expected = RunFailure(INVALID_PLAN, "drift, goal", "lf_leg", str(violations[0]))
    assert failure_of_check(violations) == expected
    assert failure_of_check([]) is None
