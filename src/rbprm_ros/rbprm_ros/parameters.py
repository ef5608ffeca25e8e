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
from dataclasses import dataclass, field
from typing import Annotated, Any, get_type_hints

from pydantic import Field, TypeAdapter, ValidationError
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from rbprm_core.errors import InvalidInput
from rbprm_core.guide.root_bounds import BoundsRule
from rbprm_core.request import PlannerOptions
from rbprm_core.robot import load_description
from rbprm_core.scene import Classification
from rbprm_core.validation import Friction, Robustness

MIN_STEP = 1e-9  # over a bound that is excluded: ROS ranges are closed
MAX_FLOAT, MAX_INTEGER = 1e9, 2**31 - 1  # where an option has no upper bound of its own
READ_ONLY = ("planning_frame", "autostart")  # the surfaces that are held are in the former
TOP = "planner"  # the field of `Settings` whose options have no prefix: `sequence.step`


@dataclass(frozen=True)
class ReplanningOptions:
    """What happens when surfaces change under a published sequence.

    Attributes:
        automatic: plan again what does not hold any more; otherwise it is only told on the status.
        time_limit: longest time for one replan, over all states it is tried from, seconds.
        max_restarts: times in a row that replanning begins anew because surfaces changed again;
            the next one is finished on the surfaces it has, and looked at then.
    """

    automatic: bool = True
    time_limit: Annotated[float, Field(gt=0, le=3600)] = 5.0
    max_restarts: Annotated[int, Field(ge=0, le=1000)] = 3


@dataclass(frozen=True)
class Settings:
    """The parameters' values at one time.

    Attributes:
        planning_frame: frame of all surfaces, poses and plans; nothing is transformed.
        robot: robot of requests that name none: a known name, or the path of a robot file.
        time_limit: longest planning time of requests that give none, seconds.
        robustness_threshold: least robustness b0 of states, newtons, of requests that give none.
        max_surfaces: most surfaces that are held.
        max_obstacles: most obstacles that are held.
        max_triangles: most triangles of all obstacles together, and of one mesh or message.
        max_vertices: most vertices of one polygon, holes included.
        max_states: most states of a sequence that is sent to be validated.
        max_calls: most calls of one service, and most goals, that wait or are served at once; what
            comes beyond ends with the code BUSY. A goal and the newer one that takes its place
            are two.
        keep_roadmaps: keep the roadmaps of the guide planner `prm` from one plan to the next of the
            same robot and bounds of the root, so that later ones are found sooner. What a request
            gives then depends on what was planned before.
        classification: how a normal decides what a surface is good for.
        marker_friction: friction coefficient of the surfaces found in marker triangles.
        autostart: come up active; otherwise the node waits to be configured and activated.
        bounds: how bounds of the root are derived.
        replanning: when surfaces change.
        planner: options of the planner.
    """

    planning_frame: Annotated[str, Field(min_length=1)] = "map"
    robot: str = "hyq"
    time_limit: Annotated[float, Field(gt=0, le=86400)] = 60.0
    robustness_threshold: Robustness = 0.0
    max_surfaces: Annotated[int, Field(ge=1)] = 10_000
    max_obstacles: Annotated[int, Field(ge=0)] = 1_000
    max_triangles: Annotated[int, Field(ge=0)] = 100_000
    max_vertices: Annotated[int, Field(ge=3)] = 1_000
    max_states: Annotated[int, Field(ge=1)] = 1_000
    max_calls: Annotated[int, Field(ge=2)] = 100
    keep_roadmaps: bool = False
    classification: Classification = field(default_factory=Classification)
    marker_friction: Friction = 0.5
    autostart: bool = True
    bounds: BoundsRule = field(default_factory=BoundsRule)
    replanning: ReplanningOptions = field(default_factory=ReplanningOptions)
    planner: PlannerOptions = field(default_factory=PlannerOptions)


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


def parse_settings(nested: dict[str, Any]) -> Settings:
    """Settings of nested values, which are all optional.

    Raises:
        InvalidInput: names the first parameter at fault.
    """
    try:
        settings = TypeAdapter(Settings).validate_python(nested)
    except ValidationError as error:
        first = error.errors()[0]
        name = _name(tuple(str(part) for part in first["loc"]))
        raise InvalidInput(name, first["input"], first["msg"]) from error
    load_description(settings.robot)
    return settings


def _name(path: tuple[str, ...]) -> str:
    """Name of the parameter at a path in `Settings`."""
    return ".".join(path[1:] if path[0] == TOP else path)


def _options(kind: type, path: tuple[str, ...] = ()) -> Iterator[Option]:
    """The parameters of an option dataclass and of those in it."""
    hints = get_type_hints(kind, include_extras=True)
    texts = attribute_texts(kind)
    for entry in dataclasses.fields(kind):
        hint, here = hints[entry.name], (*path, entry.name)
        if dataclasses.is_dataclass(hint):
            yield from _options(hint, here)  # type: ignore[arg-type]
            continue
        name = _name(here)
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
