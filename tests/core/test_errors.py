"""The texts of errors: what went wrong, and what to change."""

from __future__ import annotations

import pytest

from rbprm_core.errors import (
    ErrorCode,
    GoalUnreachable,
    InvalidInput,
    NoGuideFound,
    NoSequenceFound,
    RbprmError,
    StartUnreachable,
    TimeLimitReached,
)

STUCK = NoSequenceFound(7, "lf", "finds no contact (equilibrium)", 0.4)


@pytest.mark.parametrize("kind", [StartUnreachable, GoalUnreachable])
@pytest.mark.parametrize(
    ("reason", "remedy"),
    [
        ("limb lf finds no contact there (equilibrium)", "lower the robustness threshold"),
        ("4 contacts hold it with robustness 1.2 N only", "lower the robustness threshold"),
        ("limb lf finds no contact there (kinematics)", "fewer limbs in contact"),
        ("limb lf finds no contact there (no candidate near a surface)", "move the root"),
        ("no support surface in the workspace of limb lf", "send more surfaces"),
        ("the trunk, scaled by 1.2, collides with the environment", "away from what it collides"),
        ("limb lf, at its reference posture, is in collision", "away from what it collides"),
        ("the trunk is inside an obstacle", "out of it"),
        ("no contacts within the limbs' workspaces could bear the robot's weight", "more limbs"),
        ("no surface carries the contact of limb lf at 0, 0, 0", "contacts are there"),
        ("no limb is to be in contact", "name limbs"),
    ],
)
def test_an_end_says_what_to_change(
    kind: type[StartUnreachable | GoalUnreachable], reason: str, remedy: str
) -> None:
    error = kind(reason, "lf")
    before, _, told = str(error).partition(f" is not reachable: {reason}: ")
    assert before == ("the start" if kind is StartUnreachable else "the goal")
    assert remedy in told
    assert error.reason == reason


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (InvalidInput("goal.x", 12, "must be under 10"), "must be under 10"),
        (NoGuideFound("30 samples did not connect: widen the root bounds"), "widen the root"),
        (STUCK, "lower the robustness threshold"),
        (NoSequenceFound(3, "lf", "finds no contact (kinematics)", 0.4), "another seed"),
        (TimeLimitReached(3.0, "guide"), "raise the limit"),
        (TimeLimitReached(3.0, "guide", STUCK), "raise the limit"),
    ],
)
def test_every_other_failure_says_what_to_change(error: RbprmError, remedy: str) -> None:
    assert remedy in str(error)


def test_the_best_attempt_before_a_limit_is_told_without_a_second_remedy() -> None:
    text = str(TimeLimitReached(3.0, "guide", STUCK))
    assert "best attempt before: stopped after state 7 at limb lf, 40% of the guide" in text
    assert "robustness threshold" not in text


def test_no_code_is_left_out() -> None:
    told = {StartUnreachable, GoalUnreachable, InvalidInput, NoGuideFound, NoSequenceFound}
    codes = {kind.code for kind in told | {TimeLimitReached}}
    rest = {ErrorCode.SUCCESS, ErrorCode.INTERNAL, ErrorCode.CANCELLED}  # nothing to change
    assert codes | rest == set(ErrorCode)
