"""Old names of options: moved to the new ones, with a warning, or refused."""

from __future__ import annotations

import warnings
from typing import Any

import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.option_names import RENAMED_OPTIONS, with_new_names

RENAMED = {"a.old": "a.new", "top": "b.c.top"}


@pytest.mark.parametrize(
    ("data", "wanted"),
    [
        ({"a": {"old": 1, "other": 2}}, {"a": {"new": 1, "other": 2}}),
        ({"top": 3}, {"b": {"c": {"top": 3}}}),
        ({"top": 3, "b": {"d": 4}}, {"b": {"c": {"top": 3}, "d": 4}}),
        ({"top": 3, "b": 5}, {"b": 5}),  # refused by the reader of `b`
    ],
)
def test_a_value_moves_to_the_new_name(data: dict[str, Any], wanted: dict[str, Any]) -> None:
    before = str(data)
    with pytest.warns(FutureWarning, match="is now called"):
        assert with_new_names(data, RENAMED) == wanted
    assert str(data) == before


@pytest.mark.parametrize("data", [{}, {"a": {"new": 1}}, {"a": 3}, {"b": {"top": 1}}])
def test_new_names_are_left_alone_without_a_warning(data: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert with_new_names(data, RENAMED) == data


@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_both_names_at_once_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"is the old name of a\.new") as caught:
        with_new_names({"a": {"old": 1, "new": 2}}, RENAMED)
    assert (caught.value.field, caught.value.value) == ("a.old", 1)


def test_no_new_name_is_an_old_one_too() -> None:
    assert not set(RENAMED_OPTIONS) & set(RENAMED_OPTIONS.values())
