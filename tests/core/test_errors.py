"""The texts of errors: what went wrong, and what to change."""

from __future__ import annotations

import string

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
from rbprm_core.failure_text import (
    GUIDE_REMEDY,
    ROOT_REMEDIES,
    SEQUENCE_REMEDIES,
    TEXTS,
    failure_text,
    root_remedy,
    sequence_remedy,
)
from rbprm_core.failures import Cause, Failure

SUPPORT = ("support",)
EXAMPLES = {
    Cause.UNSPECIFIED: (Failure.of(Cause.UNSPECIFIED), "no cause is known"),
    Cause.TRUNK_IN_OBSTACLE: (
        Failure.of(Cause.TRUNK_IN_OBSTACLE),
        "the trunk is inside an obstacle",
    ),
    Cause.TRUNK_COLLISION: (
        Failure.of(Cause.TRUNK_COLLISION, scale=1.2),
        "the trunk, scaled by 1.2, collides with the environment",
    ),
    Cause.NO_SURFACE_OF_KIND: (
        Failure.of(Cause.NO_SURFACE_OF_KIND, "lf", kinds=("support", "lean")),
        "the environment has no support or lean surface for limb lf",
    ),
    Cause.NO_SURFACE_IN_WORKSPACE: (
        Failure.of(Cause.NO_SURFACE_IN_WORKSPACE, "lf", kinds=SUPPORT),
        "no support surface in the workspace of limb lf",
    ),
    Cause.WEIGHT_UNSUPPORTED: (
        Failure.of(Cause.WEIGHT_UNSUPPORTED),
        "no contacts within the limbs' workspaces can support the robot's weight",
    ),
    Cause.ROOT_COLLISION: (
        Failure.of(Cause.ROOT_COLLISION),
        "the root part of the robot collides with the environment",
    ),
    Cause.LIMB_COLLISION: (
        Failure.of(Cause.LIMB_COLLISION, "lf"),
        "limb lf is in collision",
    ),
    Cause.REFERENCE_POSTURE_COLLISION: (
        Failure.of(Cause.REFERENCE_POSTURE_COLLISION, "lf"),
        "limb lf, in its reference posture, is in collision",
    ),
    Cause.LOW_ROBUSTNESS: (
        Failure.of(Cause.LOW_ROBUSTNESS, robustness=1.234, threshold=10.0, contacts=4),
        "robustness 1.23 N under 10 N",
    ),
    Cause.SURFACE_LOST: (
        Failure.of(Cause.SURFACE_LOST, "lf", surface="ground", x=1.0, y=-0.25, z=0.0),
        "no surface supports the contact of limb lf at (1.000, -0.250, 0.000) m",
    ),
    Cause.BODY_COLLISION: (
        Failure.of(Cause.BODY_COLLISION, "lf", body="lf_shank_0"),
        "body lf_shank_0 collides with the environment",
    ),
    Cause.NO_START_LIMBS: (
        Failure.of(Cause.NO_START_LIMBS),
        "no limb is requested to be in contact",
    ),
    Cause.CONTACT_NOT_REACHED: (
        Failure.of(Cause.CONTACT_NOT_REACHED, "lf", distance=0.0125),
        "limb lf stays 0.013 m away from its contact",
    ),
    Cause.SELF_COLLISION: (
        Failure.of(Cause.SELF_COLLISION, "lf", body="lf_shank_0 and lh_shank_0"),
        "bodies lf_shank_0 and lh_shank_0 collide",
    ),
    Cause.TORQUE_LIMIT: (
        Failure.of(Cause.TORQUE_LIMIT, body="lf_kfe_joint", ratio=1.254, limit=1.0),
        "joint lf_kfe_joint needs 1.25 of its effort limit, 1 is allowed",
    ),
    Cause.TASK_NOT_MET: (
        Failure.of(Cause.TASK_NOT_MET, body="trunk upright", violation=0.0125),
        "task trunk upright is violated by 0.013",
    ),
    Cause.NO_CANDIDATE: (
        Failure.of(Cause.NO_CANDIDATE, "lf"),
        "limb lf finds no contact (no candidate near a surface)",
    ),
    Cause.NO_KINEMATIC_SOLUTION: (
        Failure.of(Cause.NO_KINEMATIC_SOLUTION, "lf"),
        "limb lf finds no contact (kinematics)",
    ),
    Cause.NO_EQUILIBRIUM: (
        Failure.of(Cause.NO_EQUILIBRIUM, "lf"),
        "limb lf finds no contact (equilibrium)",
    ),
    Cause.SECOND_CONTACT_OUT_OF_REACH: (
        Failure.of(Cause.SECOND_CONTACT_OUT_OF_REACH, "lf"),
        "a second contact leaves the reach of limb lf",
    ),
    Cause.SECOND_CONTACT_COLLISION: (
        Failure.of(Cause.SECOND_CONTACT_COLLISION, "lf"),
        "a second contact, of limb lf, is lost to a collision",
    ),
    Cause.NO_FREE_POSTURE: (
        Failure.of(Cause.NO_FREE_POSTURE, "lf"),
        "limb lf finds no posture free of collision",
    ),
    Cause.TREES_NOT_CONNECTED: (
        Failure.of(Cause.TREES_NOT_CONNECTED, samples=30, start_nodes=4, goal_nodes=2),
        "30 samples did not connect start and goal; 4 nodes were reached from the start, 2 from "
        "the goal",
    ),
    Cause.ROADMAP_NOT_CONNECTED: (
        Failure.of(Cause.ROADMAP_NOT_CONNECTED, samples=30, nodes=12, parts=3),
        "30 samples did not connect start and goal; the roadmap has 12 nodes in 3 parts",
    ),
    Cause.NO_VALID_PATH: (
        Failure.of(Cause.NO_VALID_PATH, tried=4),
        "none of 4 paths from start to goal is valid",
    ),
    Cause.EXECUTED_STATE_INVALID: (
        Failure.of(Cause.EXECUTED_STATE_INVALID, state=7),
        "state 7, which the robot is in, is invalid",
    ),
    Cause.PROCESS_DIED: (
        Failure.of(Cause.PROCESS_DIED),
        "the planning process ended without an answer",
    ),
}
"""Failure with the fields and figures that `Cause` documents, and its text, by cause."""

ROOT_CHANGES = {
    Cause.TRUNK_IN_OBSTACLE: "move the root out of it",
    Cause.TRUNK_COLLISION: "away from what it collides with",
    Cause.ROOT_COLLISION: "away from what it collides with",
    Cause.LIMB_COLLISION: "away from what it collides with",
    Cause.REFERENCE_POSTURE_COLLISION: "away from what it collides with",
    Cause.WEIGHT_UNSUPPORTED: "require more limbs",
    Cause.LOW_ROBUSTNESS: "lower the robustness threshold",
    Cause.NO_EQUILIBRIUM: "lower the robustness threshold",
    Cause.SURFACE_LOST: "contacts are supported",
    Cause.NO_START_LIMBS: "name limbs",
    Cause.EXECUTED_STATE_INVALID: "plan from a measured state",
}
"""Part of the remedy for a start or goal, by cause; of the other causes, "send more surfaces"."""

STUCK = NoSequenceFound(7, Failure.of(Cause.NO_EQUILIBRIUM, "lf"), 0.4)
CLOSED = EXAMPLES[Cause.TREES_NOT_CONNECTED][0]


def test_every_cause_has_a_text_and_an_example() -> None:
    assert set(TEXTS) == set(EXAMPLES) == set(Cause)
    assert len(set(TEXTS.values())) == len(TEXTS)


@pytest.mark.parametrize("cause", list(Cause))
def test_the_text_of_a_cause(cause: Cause) -> None:
    failure, text = EXAMPLES[cause]
    assert failure.cause == cause
    assert failure_text(failure) == text
    assert not text.endswith(".")


@pytest.mark.parametrize("cause", list(Cause))
def test_a_text_uses_only_the_fields_of_its_cause(cause: Cause) -> None:
    failure = EXAMPLES[cause][0]
    used = {name for _, name, _, _ in string.Formatter().parse(TEXTS[cause]) if name is not None}
    filled = {name for name in ("limb", "surface", "body", "kinds") if getattr(failure, name)}
    assert used <= filled | {name for name, _ in failure.figures}


@pytest.mark.parametrize("kind", [StartUnreachable, GoalUnreachable])
@pytest.mark.parametrize("cause", list(Cause))
def test_an_unreachable_root_says_what_to_change(
    kind: type[StartUnreachable | GoalUnreachable], cause: Cause
) -> None:
    failure, text = EXAMPLES[cause]
    error = kind(failure)
    which = "start" if kind is StartUnreachable else "goal"
    assert str(error) == f"the {which} is not reachable: {text}: {root_remedy(failure)}"
    assert ROOT_CHANGES.get(cause, "send more surfaces") in root_remedy(failure)
    assert (error.which, error.failure, error.limb) == (which, failure, failure.limb)


@pytest.mark.parametrize("cause", list(Cause))
def test_a_stopped_sequence_says_what_to_change(cause: Cause) -> None:
    failure, text = EXAMPLES[cause]
    error = NoSequenceFound(7, failure, 0.4)
    assert error.summary == f"stopped after state 7, 40% of the guide: {text}"
    assert str(error) == f"no contact sequence found: {error.summary}: {sequence_remedy(failure)}"
    weak = cause in (Cause.LOW_ROBUSTNESS, Cause.NO_EQUILIBRIUM)
    assert ("lower the robustness threshold" in str(error)) == weak
    assert "another seed" in str(error)
    assert (error.failure, error.limb) == (failure, failure.limb)


def test_remedies_are_those_of_the_tables() -> None:
    for cause, remedy in ROOT_REMEDIES.items():
        assert root_remedy(Failure.of(cause)) == remedy
    for cause, remedy in SEQUENCE_REMEDIES.items():
        assert sequence_remedy(Failure.of(cause)) == remedy


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (InvalidInput("goal.x", 12, "must be under 10"), "must be under 10"),
        (NoGuideFound(CLOSED), GUIDE_REMEDY),
        (STUCK, "lower the robustness threshold"),
        (TimeLimitReached(3.0, "guide"), "raise the limit"),
        (TimeLimitReached(3.0, "guide", STUCK), "raise the limit"),
    ],
)
def test_every_other_failure_says_what_to_change(error: RbprmError, remedy: str) -> None:
    assert remedy in str(error)


def test_a_missing_guide_tells_the_size_of_the_search() -> None:
    error = NoGuideFound(CLOSED, 6)
    assert failure_text(CLOSED) in str(error)
    assert "widen the root" in str(error)
    assert (error.failure, error.nodes, error.limb) == (CLOSED, 6, "")


def test_the_best_attempt_before_a_limit_has_no_second_remedy() -> None:
    error = TimeLimitReached(3.0, "guide", STUCK)
    assert f"(best attempt before: {STUCK.summary})" in str(error)
    assert "robustness threshold" not in str(error)
    assert (error.failure, error.limb) == (STUCK.failure, "lf")
    assert TimeLimitReached(3.0, "guide").failure is None
    assert TimeLimitReached(3.0, "guide").limb == ""


def test_no_code_is_left_out() -> None:
    kinds = {StartUnreachable, GoalUnreachable, InvalidInput, NoGuideFound, NoSequenceFound}
    codes = {kind.code for kind in kinds | {TimeLimitReached}}
    rest = {ErrorCode.SUCCESS, ErrorCode.INTERNAL, ErrorCode.CANCELLED}  # nothing to change
    assert codes | rest == set(ErrorCode)
