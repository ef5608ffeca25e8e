"""The node's settings as plain data, without ROS: names, defaults, ranges and descriptions."""

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

TOP = "planner"  # field of `Settings` whose options have no prefix: `sequence.step`


@dataclass(frozen=True)
class ReplanningOptions:
    """Automatic replanning of a published sequence when surfaces change.

    Attributes:
        automatic: replan the published sequence when some of its states become invalid; otherwise
            only the status reports them.
        time_limit: longest time for one replan, over all states from which it is tried, seconds.
        max_restarts: maximum number of times in a row that replanning begins again because surfaces
            changed meanwhile; the next replan is completed, and its result validated on the newest
            surfaces.
    """

    automatic: bool = True
    time_limit: Annotated[float, Field(gt=0, le=3600)] = 5.0
    max_restarts: Annotated[int, Field(ge=0, le=1000)] = 3


@dataclass(frozen=True)
class Settings:
    """Values of all parameters at one time.

    Attributes:
        planning_frame: frame of all surfaces, poses and plans; nothing is transformed.
        robot: robot of requests that name none: a known name, or the path of a robot file.
        time_limit: longest planning time of requests that give none, seconds.
        robustness_threshold: minimum robustness b0 of states in requests that give none, newtons.
        max_surfaces: maximum number of surfaces in the environment.
        max_obstacles: maximum number of obstacles in the environment.
        max_triangles: maximum number of triangles of all obstacles together, and of one mesh or
            message.
        max_vertices: maximum number of vertices of one polygon, holes included.
        max_states: maximum number of states of a sequence sent for validation.
        max_calls: maximum number of calls of one service, and of goals, that wait or are served at
            once; further ones end with the code BUSY. A goal and the newer one that preempts it
            count as two.
        keep_roadmaps: keep the roadmaps of the guide planner `prm` from one plan to the next of the
            same robot and bounds of the root, so that later plans are found sooner. The result of a
            request then depends on earlier requests.
        classification: rules that assign a kind to a surface.
        marker_friction: coefficient of Coulomb friction of the surfaces found in marker triangles.
        autostart: start active; otherwise the node waits for a lifecycle manager.
        bounds: rules by which bounds of the root are derived.
        replanning: automatic replanning.
        stages: implementation of each stage in requests that name none.
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
    """The settings from nested values.

    Args:
        nested: values by field of `Settings`, all of them optional.

    Raises:
        InvalidInput: names the first invalid parameter.
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
    """Name of the parameter for a path of nested fields in `Settings`.

    Args:
        path: names of the nested fields.
    """
    return ".".join(path[1:] if path[0] == TOP else path)
