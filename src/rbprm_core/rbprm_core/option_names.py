"""Options whose names changed: the old names work for one release more, with a warning."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Mapping
from typing import Any

from rbprm_core.errors import InvalidInput

RENAMED_OPTIONS: Mapping[str, str] = {
    "generator.most_robust": "generator.accept_below_threshold",
    "shortcuts": "guide.shortcuts",
    "settle": "guide.settle",
    "guide.planner": "stages.guide",
    "sequence.least_step": "sequence.min_step",
    "classification.least_area": "classification.min_area",
}
"""New name by old name, both without the table that holds them in a file: the names of the node's
parameters."""


def warn_renamed(old: str, new: str) -> None:
    """Warn that an option is given by its old name.

    Args:
        old: name that was given.
        new: name to use instead.
    """
    text = f"{old} is now called {new}; the old name will be refused in the next release"
    warnings.warn(text, FutureWarning, stacklevel=3)


def with_new_names(data: Mapping[str, Any], renamed: Mapping[str, str]) -> dict[str, Any]:
    """Nested tables in which every option stands under its new name; warns of old ones.

    Args:
        data: tables as read from a file; not changed.
        renamed: dotted new name by dotted old name, from the outermost table on.

    Raises:
        InvalidInput: an option is given by its old name and by its new one.
    """
    result = copy.deepcopy(dict(data))
    for old, new in renamed.items():
        source, old_key = _table(result, old)
        if source is None or old_key not in source:
            continue
        warn_renamed(old, new)
        value = source.pop(old_key)
        target, new_key = _table(result, new, make=True)
        if target is None:
            continue  # no table is where one must be, which is refused when the options are read
        if new_key in target:
            raise InvalidInput(old, value, f"is the old name of {new}, which is given too")
        target[new_key] = value
    return result


def _table(
    data: dict[str, Any], name: str, make: bool = False
) -> tuple[dict[str, Any] | None, str]:
    """The table that holds a dotted name, None where there is none, and the name's last part."""
    *path, last = name.split(".")
    table: Any = data
    for key in path:
        table = table.setdefault(key, {}) if make else table.get(key)
        if not isinstance(table, dict):
            return None, last
    return table, last
