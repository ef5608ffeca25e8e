"""Checks of values from outside, and the texts of errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.errors import (
    ErrorCode,
    GoalUnreachable,
    InvalidInput,
    NoSequenceFound,
    RbprmError,
    StartUnreachable,
)
from rbprm_core.failure_text import failure_text
from rbprm_core.failures import Cause, Failure
from rbprm_core.validation import finite_array, finite_number, one_of


@given(st.lists(st.tuples(*[st.floats(-1e9, 1e9)] * 3), max_size=5))
def test_finite_arrays_pass(rows: list[tuple[float, ...]]) -> None:
    value = np.array(rows).reshape(-1, 3)
    assert np.array_equal(finite_array("a", value, (-1, 3)), value)


def test_the_array_is_a_copy() -> None:
    value = np.zeros(3)
    finite_array("a", value, (3,))[0] = 1
    assert value[0] == 0


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ([0, 0], "has shape|must have shape 3"),
        ([[0, 0, 0]], "shape"),
        ([0, 0, None], "finite|numbers"),
        ([0, 0, "x"], "numbers"),
        ([0, 0, float("nan")], "finite"),
        ([0, 0, -float("inf")], "finite"),
        ({}, "numbers"),
    ],
)
def test_other_arrays_do_not(value: Any, reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        finite_array("there", value, (3,))
    assert caught.value.field == "there"
    assert caught.value.value is value


@pytest.mark.parametrize("value", [0.5, 1, np.float32(1.0), 2])
def test_numbers_within_bounds_pass(value: Any) -> None:
    assert finite_number("a", value, 0.5, 2) == float(value)


@pytest.mark.parametrize("value", [0.49, 2.01, float("nan"), float("inf"), "x", [1.0], None])
def test_other_numbers_do_not(value: Any) -> None:
    with pytest.raises(InvalidInput):
        finite_number("a", value, 0.5, 2)


def test_one_of_what_is_known() -> None:
    assert one_of("a", "x", ("x", "y")) == "x"
    with pytest.raises(InvalidInput, match="known are x, y"):
        one_of("a", "z", ("x", "y"))
    with pytest.raises(InvalidInput, match="known are none"):
        one_of("a", "z", ())


def test_a_long_value_is_cut() -> None:
    text = str(InvalidInput("vertices", [[0.0, 0.0, 0.0]] * 1000, "is long"))
    assert text.startswith("vertices = [[0.0")
    assert text.endswith("is long")
    assert len(text) < 300


def test_every_error_has_a_code_of_its_own() -> None:
    kinds: list[type[RbprmError]] = [
        RbprmError,
        # Other packages derive errors of their own, which share INTERNAL.
        *(k for k in RbprmError.__subclasses__() if k.__module__ == RbprmError.__module__),
        StartUnreachable,
        GoalUnreachable,
    ]
    codes = [kind.code for kind in kinds if kind.__name__ != "RootUnreachable"]
    assert sorted(codes) == [code for code in ErrorCode if code is not ErrorCode.SUCCESS]


def test_where_a_sequence_stopped() -> None:
    failure = Failure.of(Cause.NO_EQUILIBRIUM, "lf_leg")
    text = str(NoSequenceFound(7, failure, 0.25))
    assert f"after state 7, 25% of the guide: {failure_text(failure)}: " in text
    assert "limb" not in str(NoSequenceFound(7, Failure.of(Cause.ROOT_COLLISION), 0.25))
