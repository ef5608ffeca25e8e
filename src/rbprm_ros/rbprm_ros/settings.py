"""The node's settings as plain data, without ROS: their names, defaults, ranges and meaning."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from rbprm_core.errors import InvalidInput
from rbprm_core.guide.root_bounds import BoundsRule
from rbprm_core.request import PlannerOptions, StageNames, check_options, check_stages
from rbprm_core.robot import load_description
from rbprm_core.scene import Classification
from rbprm_core.validation import Friction, Robustness

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
        stages: which implementation does the work of each stage, in requests that name none.
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
    stages: StageNames = field(default_factory=StageNames)
    planner: PlannerOptions = field(default_factory=PlannerOptions)


def parse_settings(nested: dict[str, Any]) -> Settings:
    """Settings of nested values, which are all optional.

    Raises:
        InvalidInput: names the first parameter at fault.
    """
    try:
        settings = TypeAdapter(Settings).validate_python(nested)
    except ValidationError as error:
        first = error.errors()[0]
        name = parameter_name(tuple(str(part) for part in first["loc"]))
        raise InvalidInput(name, first["input"], first["msg"]) from error
    check_options(settings.planner)
    check_stages(settings.stages, "stages.")
    load_description(settings.robot)
    return settings


def parameter_name(path: tuple[str, ...]) -> str:
    """Name of the parameter at a path in `Settings`."""
    return ".".join(path[1:] if path[0] == TOP else path)
