"""The scenario file (TOML): robot, environment and request, by name or by path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, create_model
from pydantic.fields import FieldInfo

from rbprm_core.contacts.heuristics import check_names
from rbprm_core.environment import load_scene, polygon_surfaces
from rbprm_core.errors import InvalidInput
from rbprm_core.files import known_files, read_toml
from rbprm_core.option_names import RENAMED_OPTIONS, with_new_names
from rbprm_core.plan_record import (
    BoundsEntry,
    ClassificationEntry,
    EnvironmentEntry,
    MeshEntry,
    Pose,
    Quaternion,
    RequestFields,
    SurfaceEntry,
)
from rbprm_core.plan_record.request_entry import TimeLimit
from rbprm_core.request import PlannerOptions, PlanRequest, StageNames
from rbprm_core.robot import Robot, known_robots, load_description
from rbprm_core.robot.description import MAX_SCALE, Weights
from rbprm_core.scene import Classification, Scene
from rbprm_core.surface_kind import SurfaceKind
from rbprm_core.validation import FILE_NAME, Coordinate, Record, naming_fields, parse_record

RobotName = Annotated[str, Field(pattern=FILE_NAME)]

TABLES = {"classification": "environment.classification", "stages": "stages"}
"""Table of a scenario that holds an option, by the first part of the option's name; the others are
in `options`."""

FIELDS = {"options": "options", "stages": "stages", "seed": "seed"}
"""Fields of a `PlanRequest` that a scenario has outside of its table `request`."""

MISSPELT = 0.9
"""Ratio of difflib from which on a name counts as a misspelt one: one letter in five differs."""


class PoseText(Pose, extra="forbid"):
    """A placement of the root.

    Attributes:
        position: (3,) metres.
        orientation: (4,) unit quaternion [x, y, z, w].
    """

    position: tuple[Coordinate, Coordinate, Coordinate]
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)


class BoundsText(BoundsEntry, extra="forbid"):
    """Where the root may be; unknown keys are errors."""


class RequestText(RequestFields, extra="forbid"):
    """Start, goal and conditions, see `RequestFields`; unknown keys are errors."""

    start: PoseText
    goal: PoseText
    bounds: BoundsText
    time_limit: TimeLimit = 60.0


def _optional(fields: Mapping[str, FieldInfo]) -> dict[str, Any]:
    """The same fields, each of which may be left out."""
    return {name: (info.rebuild_annotation() | None, None) for name, info in fields.items()}


if TYPE_CHECKING:
    RobotChanges = Record
else:
    RobotChanges = create_model(
        "RobotChanges",
        __base__=Record,
        __doc__="Fields of the request that differ for another robot.",
        **_optional(RequestText.model_fields),
    )


class TrunkText(Record):
    """A trunk volume $W_0$ that differs from the robot file's, see `VolumeSettings`.

    Attributes:
        links: names of the links that make the volume; the robot file's where None.
        scale: factor by which their hulls are scaled; the robot file's where None.
    """

    links: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    scale: Annotated[float, Field(ge=1, le=MAX_SCALE)] | None = None


class MeshText(MeshEntry, extra="forbid"):
    """A mesh of the environment; unknown keys are errors."""


class SurfaceText(SurfaceEntry, extra="forbid"):
    """A polygon of the environment; unknown keys are errors."""


class EnvironmentText(Record):
    """The environment.

    Attributes:
        meshes: meshes, which are cut into contact surfaces.
        surfaces: polygons that are contact surfaces.
        classification: how normals decide what a surface is used for.
    """

    meshes: tuple[MeshText, ...] = ()
    surfaces: tuple[SurfaceText, ...] = ()
    classification: Classification = Classification()


class EditText(Record):
    """A change of the environment during execution.

    Attributes:
        name: name of the change, for reports.
        at: share of the sequence's states that are executed before the change, 0 to 1.
        surfaces: polygons that are added (new ids) or changed (known ids).
        removed: ids of the surfaces that are removed.
    """

    name: str
    at: Annotated[float, Field(ge=0, lt=1)]
    surfaces: tuple[SurfaceText, ...] = ()
    removed: tuple[str, ...] = ()


class Scenario(Record):
    """The content of a scenario file.

    Attributes:
        name: name of the scenario.
        robot: known name or path of the robot file of the scenario's own robot.
        limbs: names of the limbs of that robot that make contact; its default ones where None.
        root_joints: names of the joints of that robot planned with the root; the robot file's
            choice where None.
        heuristics: weights of heuristics by name of limb; other limbs keep the robot file's.
        surfaces: kinds of surface by name of limb; other limbs keep the robot file's.
        trunk: trunk volume of that robot.
        environment: meshes and polygons.
        request: start, goal and conditions.
        options: options of the planner.
        stages: implementations by stage.
        robots: fields of the request that differ for other robots, by name of robot.
        edits: changes of the environment, each after those before.
    """

    name: Annotated[str, Field(pattern=FILE_NAME)]
    robot: str
    limbs: tuple[str, ...] | None = None
    root_joints: tuple[str, ...] | None = None
    heuristics: dict[str, Weights] = {}
    surfaces: dict[str, Annotated[tuple[SurfaceKind, ...], Field(min_length=1)]] = {}
    trunk: TrunkText = TrunkText()
    environment: EnvironmentText
    request: RequestText
    options: PlannerOptions = PlannerOptions()
    stages: StageNames = StageNames()
    robots: dict[RobotName, RobotChanges] = {}
    edits: tuple[EditText, ...] = ()

    def load_robot(self, robot: str | None = None) -> Robot:
        """The robot with the limbs, heuristics, surfaces and trunk that the scenario chooses.

        Another robot keeps the choices of its own file.

        Args:
            robot: known name or path of a robot file; the scenario's own robot where None.

        Raises:
            InvalidInput: see `load_description`, `RobotDescription.using` and `Robot.load`;
                heuristics of an unknown limb or name.
        """
        own = load_description(self.robot)
        description = own if robot is None else load_description(robot)
        if description.name == own.name:
            description = description.using(self.limbs, self.root_joints)
            for limb, weights in self.heuristics.items():
                check_names(weights, f"heuristics.{limb}")
            description = description.with_heuristics(self.heuristics).with_surfaces(self.surfaces)
            description = description.with_trunk(self.trunk.links, self.trunk.scale)
        return Robot.load(description)

    def request_for(
        self, robot: Robot, seed: int = 0, robustness_threshold: float | None = None
    ) -> PlanRequest:
        """The validated request for a robot.

        Args:
            robot: the scenario's own robot, or another one.
            seed: seed of the random generator.
            robustness_threshold: minimum raw b0 in newtons; the file's where None.

        Raises:
            InvalidInput: see `PlanRequest.validated`; fields are named as in the file.
        """
        fields: RequestFields = self.request_text(robot.name)
        names = FIELDS
        if robustness_threshold is not None:
            fields = fields.model_copy(update={"robustness_threshold": robustness_threshold})
            names = {**FIELDS, "robustness_threshold": "robustness_threshold"}
        with naming_fields(names, "request."):
            return PlanRequest.from_fields(
                fields,
                [limb.name for limb in robot.limbs],
                seed=seed,
                options=self.options,
                stages=self.stages,
            )

    def request_text(self, robot: str) -> RequestText:
        """The request as the file holds it for a robot.

        Args:
            robot: name of the robot.

        Raises:
            InvalidInput: the file has changes for a robot whose name is a known one misspelt.
        """
        # Other names may belong to a user's own robots, which are known by their files alone.
        for name in self.robots:
            meant = None if name == robot else _misspelt(name)
            if meant is not None:
                raise InvalidInput("robots", name, f"unknown; did you mean {meant}?")
        changes = self.robots.get(robot)
        changed: dict[str, Any] = {}
        if changes is not None:
            changed = {k: getattr(changes, k) for k in changes.model_fields_set}
        return self.request.model_copy(update=changed)

    def environment_entry(self) -> EnvironmentEntry:
        """The environment as the plan file holds it."""
        text = self.environment
        return EnvironmentEntry(
            name=self.name,
            meshes=text.meshes,
            surfaces=text.surfaces,
            classification=ClassificationEntry(**asdict(text.classification)),
        )

    def scene(self) -> Scene:
        """The environment read and cut into surfaces."""
        return load_scene(self.environment_entry(), self.environment.classification)

    def edited(self, scene: Scene, edit: int) -> Scene:
        """A scene after one of the scenario's edits.

        Args:
            scene: scene before the edit.
            edit: index of the edit.

        Raises:
            InvalidInput: a polygon that cannot be used, a removed id that is not there.
        """
        text, field = self.edits[edit], f"edits.{edit}"
        changed = polygon_surfaces(text.surfaces, self.environment.classification, field)
        return scene.edited(changed, text.removed)


def known_scenarios() -> dict[str, Path]:
    """Names of the scenarios that come with the package, and their files."""
    return known_files("rbprm_core", "scenarios")


def load_scenario(scenario: str) -> Scenario:
    """The scenario of a known name or of a file.

    Args:
        scenario: known name, or path of a scenario file.

    Raises:
        InvalidInput: unknown scenario, unreadable file, or a field at fault.
    """
    return parse_scenario(read_toml(scenario, known_scenarios(), "scenario"))


def parse_scenario(data: dict[str, Any]) -> Scenario:
    """The scenario of a file's content; options may have their old names.

    Args:
        data: tables of the file.

    Raises:
        InvalidInput: a field at fault.
    """
    renamed = {_place(old): _place(new) for old, new in RENAMED_OPTIONS.items()}
    return parse_record(Scenario, with_new_names(data, renamed), "scenario")


def _place(option: str) -> str:
    """Where an option stands in the file: its name after the table that holds it."""
    first, dot, rest = option.partition(".")
    return TABLES.get(first, f"options.{first}") + dot + rest


def _misspelt(name: str) -> str | None:
    """The known robot that a misspelt name means; None for a known name, or for none like it."""
    known = known_robots()
    if name in known:
        return None
    # Another number is another robot.
    numbered = [other for other in known if _digits(other) == _digits(name)]
    return next(iter(get_close_matches(name.lower(), numbered, 1, MISSPELT)), None)


def _digits(name: str) -> list[str]:
    return [letter for letter in name if letter.isdigit()]
