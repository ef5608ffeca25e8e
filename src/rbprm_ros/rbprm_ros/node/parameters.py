"""The node's parameters, each declared once: name, default, description and range.

Those of the planner are made from the core's option dataclasses: an option added there is a
parameter here. All but the planning frame can be set at run time, for the calls that follow; a
wrong value is refused with the reason.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_type_hints

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from rbprm_core.errors import InvalidInput
from rbprm_ros.settings import Settings, parameter_name, parse_settings

MIN_STEP = 1e-9  # over a bound that is excluded: ROS ranges are closed
MAX_FLOAT, MAX_INTEGER = 1e9, 2**31 - 1  # where an option has no upper bound of its own
READ_ONLY = ("planning_frame", "autostart")  # the surfaces that are held are in the former


@dataclass(frozen=True)
class Option:
    """A parameter: its dotted name, where it is in `Settings`, and what ROS is told of it."""

    name: str
    path: tuple[str, ...]
    default: object
    descriptor: ParameterDescriptor


class Parameters:
    """Declares the parameters on a node, guards their changes and holds what they say.

    Raises:
        rclpy.exceptions.ParameterException: an override of wrong type or out of range.
        InvalidInput: an override that is wrong in another way, such as an unknown robot.
    """

    def __init__(self, node: Node) -> None:
        self._options = {option.name: option for option in parameter_options()}
        self._values: dict[str, Any] = {}
        for name, option in self._options.items():
            self._values[name] = node.declare_parameter(
                name, option.default, option.descriptor
            ).value
        self.settings = self._parsed(self._values)
        """The values as they are now."""
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._take)

    def _check(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            self._parsed(self._changed(changes))
        except InvalidInput as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take(self, changes: list[Parameter]) -> None:
        self._values = self._changed(changes)
        self.settings = self._parsed(self._values)

    def _changed(self, changes: list[Parameter]) -> dict[str, Any]:
        """The values with some changed; parameters of rclpy's own are none of ours."""
        return {**self._values, **{p.name: p.value for p in changes if p.name in self._options}}

    def _parsed(self, values: dict[str, Any]) -> Settings:
        nested: dict[str, Any] = {}
        for name, value in values.items():
            *parents, last = self._options[name].path
            inner = nested
            for parent in parents:
                inner = inner.setdefault(parent, {})
            inner[last] = value
        return parse_settings(nested)


def parameter_options() -> tuple[Option, ...]:
    """All parameters, in the order of `Settings`."""
    return tuple(_options(Settings))


def _options(kind: type, path: tuple[str, ...] = ()) -> Iterator[Option]:
    """The parameters of an option dataclass and of those in it."""
    hints = get_type_hints(kind, include_extras=True)
    texts = attribute_texts(kind)
    for entry in dataclasses.fields(kind):
        hint, here = hints[entry.name], (*path, entry.name)
        if dataclasses.is_dataclass(hint):
            yield from _options(hint, here)  # type: ignore[arg-type]
            continue
        name = parameter_name(here)
        descriptor = ParameterDescriptor(
            description=texts[entry.name], read_only=name in READ_ONLY, **_ranges(hint)
        )
        yield Option(name, here, entry.default, descriptor)


def _ranges(hint: Any) -> dict[str, list[FloatingPointRange] | list[IntegerRange]]:
    """What `Annotated[float, Field(ge=…)]` means to ROS; nothing for other types."""
    kind = getattr(hint, "__origin__", hint)
    limits: dict[str, float] = {}
    for extra in getattr(hint, "__metadata__", ()):
        for limit in extra.metadata:
            limits.update(dataclasses.asdict(limit))
    low = limits.get("ge", limits["gt"] + MIN_STEP if "gt" in limits else None)
    if kind is float:
        low = -MAX_FLOAT if low is None else float(low)
        high = float(limits.get("le", MAX_FLOAT))
        return {"floating_point_range": [FloatingPointRange(from_value=low, to_value=high)]}
    if kind is int:
        low = -MAX_INTEGER if low is None else int(low)
        high = int(limits.get("le", MAX_INTEGER))
        return {"integer_range": [IntegerRange(from_value=low, to_value=high, step=1)]}
    return {}


def attribute_texts(kind: type) -> dict[str, str]:
    """What the section "Attributes:" of a class's docstring says of each attribute."""
    section = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2]
    found = re.findall(r"^    (\w+): (.*(?:\n {5,}.*)*)", section, flags=re.MULTILINE)
    return {name: re.sub(r"\s+", " ", text) for name, text in found}
