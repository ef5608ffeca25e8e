"""The node's parameters, made from `Settings`: name, default, description, range and choices.

All but the read-only ones can be set at run time, for the calls that follow; a wrong value is
refused with the reason. Old names are accepted for one release, with a warning.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
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

from rbprm_core.contacts.registry import CONTACT_PLANNERS
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.registry import GUIDE_PLANNERS
from rbprm_core.option_names import RENAMED_OPTIONS
from rbprm_core.robot import known_robots
from rbprm_ros.settings import Settings, parameter_name, parse_settings

MIN_STEP = 1e-9  # added to an excluded bound, since the ranges of ROS include their bounds
MAX_FLOAT, MAX_INTEGER = 1e9, 2**31 - 1  # upper bounds of options without one
READ_ONLY = ("planning_frame", "autostart")  # known surfaces are in the planning frame
RENAMED_PARAMETERS: Mapping[str, str] = {
    **RENAMED_OPTIONS,
    "replanning.most_restarts": "replanning.max_restarts",
}
"""New name by old name; old names are accepted for one release."""
CHOICES: Mapping[str, Callable[[], tuple[str, ...]]] = {
    "robot": lambda: (*known_robots(), "path of a robot file"),
    "stages.guide": GUIDE_PLANNERS.names,
    "stages.contacts": CONTACT_PLANNERS.names,
}
"""Valid values by name of the parameter, where it has a choice."""


@dataclass(frozen=True)
class Option:
    """A parameter.

    Attributes:
        name: dotted name.
        path: names of the nested fields in `Settings`.
        default: default value.
        descriptor: description, range and choices.
    """

    name: str
    path: tuple[str, ...]
    default: object
    descriptor: ParameterDescriptor


class Parameters:
    """Declares the parameters on a node, validates changes and holds the values.

    Args:
        node: the node.

    Attributes:
        settings: the current values.

    Raises:
        rclpy.exceptions.ParameterException: an override of wrong type or out of range.
        InvalidInput: an override that is invalid in another way, such as an unknown robot.
    """

    def __init__(self, node: Node) -> None:
        self._logger = node.get_logger()
        self._options = {option.name: option for option in parameter_options()}
        defaults = {name: option.default for name, option in self._options.items()}
        defaults |= self._overrides_of_old_names(node)
        self._values: dict[str, Any] = {
            name: node.declare_parameter(name, defaults[name], option.descriptor).value
            for name, option in self._options.items()
        }
        self.settings = self._parsed(self._values)
        node.add_pre_set_parameters_callback(self._with_new_names)
        node.add_on_set_parameters_callback(self._validate)
        node.add_post_set_parameters_callback(self._accept)

    def _overrides_of_old_names(self, node: Node) -> dict[str, Any]:
        """Overrides, such as those of a parameter file, that are given by an old name.

        Raises:
            InvalidInput: a parameter is given by its old and by its new name.
        """
        found: dict[str, Any] = {}
        for old, new in RENAMED_PARAMETERS.items():
            value = override(node, old)
            if value is None:
                continue
            if override(node, new) is not None:
                raise InvalidInput(old, value, f"is the old name of {new}, which is given too")
            self._warn_renamed(old, new)
            found[new] = value
        return found

    def _with_new_names(self, changes: list[Parameter]) -> list[Parameter]:
        """Changes at run time, with new names instead of old ones."""
        renamed = []
        for change in changes:
            new = RENAMED_PARAMETERS.get(change.name)
            if new is not None:
                self._warn_renamed(change.name, new)
                change = Parameter(new, change.type_, change.value)
            renamed.append(change)
        return renamed

    def _warn_renamed(self, old: str, new: str) -> None:
        text = f"parameter {old} is now called {new}; the next release ignores the old name"
        self._logger.warning(text)

    def _validate(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            self._parsed(self._changed(changes))
        except InvalidInput as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept(self, changes: list[Parameter]) -> None:
        self._values = self._changed(changes)
        self.settings = self._parsed(self._values)

    def _changed(self, changes: list[Parameter]) -> dict[str, Any]:
        """The values after some changes; changes of rclpy's own parameters are ignored."""
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


def override(node: Node, name: str) -> Any:
    """The override of a parameter that is not declared; None where there is none.

    Args:
        node: the node.
        name: name of the parameter.
    """
    value = node.declare_parameter(name, None, ParameterDescriptor(dynamic_typing=True)).value
    node.undeclare_parameter(name)
    return value


def parameter_options() -> tuple[Option, ...]:
    """All parameters, in the order of `Settings`."""
    return tuple(_options(Settings))


def _options(kind: type, path: tuple[str, ...] = ()) -> Iterator[Option]:
    """The parameters of an option dataclass and of those nested in it."""
    hints = get_type_hints(kind, include_extras=True)
    texts = attribute_texts(kind)
    for entry in dataclasses.fields(kind):
        hint, here = hints[entry.name], (*path, entry.name)
        if dataclasses.is_dataclass(hint):
            yield from _options(hint, here)  # type: ignore[arg-type]
            continue
        name = parameter_name(here)
        descriptor = ParameterDescriptor(
            description=texts[entry.name],
            additional_constraints=_constraints(name),
            read_only=name in READ_ONLY,
            **_ranges(hint),
        )
        yield Option(name, here, entry.default, descriptor)


def _constraints(name: str) -> str:
    """The choices of a parameter, in words; "" where it has none."""
    return f"one of: {', '.join(CHOICES[name]())}" if name in CHOICES else ""


def _ranges(hint: Any) -> dict[str, list[FloatingPointRange] | list[IntegerRange]]:
    """Ranges of a ROS parameter from `Annotated[float, Field(ge=…)]`; none for other types."""
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
    """Descriptions in the section "Attributes:" of a class's docstring, by attribute.

    Args:
        kind: the class.
    """
    section = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2]
    found = re.findall(r"^    (\w+): (.*(?:\n {5,}.*)*)", section, flags=re.MULTILINE)
    return {name: re.sub(r"\s+", " ", text) for name, text in found}
