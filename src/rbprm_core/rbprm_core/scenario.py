"""The scenario file (TOML): robot, environment and request, by name or by path."""

from __future__ import annotations

import math
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from rbprm_core.contacts.heuristics import check_names
from rbprm_core.environment import load_scene, polygon_surfaces
from rbprm_core.errors import InvalidInput
from rbprm_core.files import known_files, read_toml
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.option_names import RENAMED_OPTIONS, with_new_names
from rbprm_core.placement import Placement
from rbprm_core.plan_record import EnvironmentEntry, MeshEntry, SurfaceEntry
from rbprm_core.request import PlannerOptions, PlanRequest, limb_names
from rbprm_core.robot import Robot, known_robots, load_description
from rbprm_core.robot.description import MAX_SCALE, Weights
from rbprm_core.scene import Classification, Scene
from rbprm_core.statics import GRIP_FORCE
from rbprm_core.surface_kind import SurfaceKind
from rbprm_core.validation import (
    FILE_NAME,
    MAX_FORCE,
    Acceleration,
    Coordinate,
    Record,
    Robustness,
    finite_number,
    parse_record,
)

Range = tuple[Coordinate, Coordinate]
Gravity = tuple[Acceleration, Acceleration, Acceleration]
HalfRange = Annotated[float, Field(ge=0, le=math.tau)]
GripForce = Annotated[float, Field(gt=0, le=MAX_FORCE)]
TimeLimit = Annotated[float, Field(gt=0, le=1e6)]
RobotName = Annotated[str, Field(pattern=FILE_NAME)]

TABLES = {"classification": "environment.classification"}
"""Table of a scenario that holds an option, by the first part of the option's name; the others are
in `options`."""

SLIP = 0.9  # difflib's ratio from which on a name is one misspelt: a letter more or less in five


class PoseText(Record):
    """A placement of the root; orientation is [x, y, z, w]."""

    position: tuple[Coordinate, Coordinate, Coordinate]
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


class BoundsText(Record):
    """Where the root may be: metres, and largest absolute angles in radians."""

    x: Range
    y: Range
    z: Range
    yaw: HalfRange
    pitch: HalfRange
    roll: HalfRange


class RequestText(Record):
    """Start, goal and conditions; see `PlanRequest`."""

    start: PoseText
    goal: PoseText
    bounds: BoundsText
    required_limbs: tuple[str, ...] | None = None
    start_limbs: tuple[str, ...] | None = None
    goal_limbs: tuple[str, ...] | None = None
    robustness_threshold: Robustness = 0.0
    gravity: Gravity = (0.0, 0.0, -9.81)
    grip_force: GripForce = GRIP_FORCE
    time_limit: TimeLimit = 60.0


class RobotChanges(Record):
    """What of the request is different for another robot."""

    start: PoseText | None = None
    goal: PoseText | None = None
    bounds: BoundsText | None = None
    required_limbs: tuple[str, ...] | None = None
    start_limbs: tuple[str, ...] | None = None
    goal_limbs: tuple[str, ...] | None = None
    robustness_threshold: Robustness | None = None
    gravity: Gravity | None = None
    grip_force: GripForce | None = None
    time_limit: TimeLimit | None = None


class TrunkText(Record):
    """Another trunk volume W0 than the robot file's; see `VolumeSettings`."""

    links: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    scale: Annotated[float, Field(ge=1, le=MAX_SCALE)] | None = None


class MeshText(MeshEntry, extra="forbid"):
    """A mesh of the environment; unknown keys are errors."""


class SurfaceText(SurfaceEntry, extra="forbid"):
    """A polygon of the environment; unknown keys are errors."""


class EnvironmentText(Record):
    """Meshes, polygons, and how normals decide what a surface is good for."""

    meshes: tuple[MeshText, ...] = ()
    surfaces: tuple[SurfaceText, ...] = ()
    classification: Classification = Classification()


class EditText(Record):
    """A change of the environment while the robot walks.

    Attributes:
        name: for people. at: share of the sequence's states that are executed when it happens.
        surfaces: added (a new id) or changed (a known id). removed: ids.
    """

    name: str
    at: Annotated[float, Field(ge=0, lt=1)]
    surfaces: tuple[SurfaceText, ...] = ()
    removed: tuple[str, ...] = ()


class Scenario(Record):
    """A scenario as its file says it.

    Attributes:
        limbs: names of the scenario's robot's limbs that make contact; None for its default ones.
        root_joints: joints of that robot planned with the root; None for its own choice.
        heuristics, surfaces: of that robot's limbs, by name of limb; the others keep the robot
            file's.
        trunk: that robot's volume W0, where it is not the robot file's.
        edits: changes of the environment, each on top of those before.
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
    robots: dict[RobotName, RobotChanges] = {}
    edits: tuple[EditText, ...] = ()

    def load_robot(self, robot: str | None = None) -> Robot:
        """The robot with the limbs that the scenario uses.

        Args:
            robot: a known name or a file, instead of the scenario's own robot.

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
        """The request for a robot, which need not be the scenario's own.

        Args:
            seed: of everything random. robustness_threshold: newtons, instead of the file's.

        Raises:
            InvalidInput: a limb that the robot does not have, empty bounds, a bad quaternion.
        """
        text = self.request_text(robot.name)
        if robustness_threshold is None:
            robustness_threshold = text.robustness_threshold
        return PlanRequest(
            start=_placement(text.start, "request.start"),
            goal=_placement(text.goal, "request.goal"),
            bounds=_bounds(text.bounds),
            required_limbs=_limbs(robot, text.required_limbs, "request.required_limbs"),
            start_limbs=_limbs(robot, text.start_limbs, "request.start_limbs"),
            goal_limbs=_goal_limbs(robot, text.goal_limbs),
            robustness_threshold=finite_number(
                "robustness_threshold", robustness_threshold, low=0.0, high=MAX_FORCE
            ),
            seed=seed,
            gravity=np.array(text.gravity),
            grip_force=text.grip_force,
            options=self.options,
        )

    def request_text(self, robot: str) -> RequestText:
        """The request as the file says it for a robot.

        Raises:
            InvalidInput: the file has changes for a robot whose name is a known one misspelt.
        """
        # Other names may be of robots of the user's own, which are known by their files alone.
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
        """The environment as the plan file names it."""
        text = self.environment
        return EnvironmentEntry(name=self.name, meshes=text.meshes, surfaces=text.surfaces)

    def scene(self) -> Scene:
        """The environment read and cut into surfaces."""
        return load_scene(self.environment_entry(), self.environment.classification)

    def edited(self, scene: Scene, edit: int) -> Scene:
        """A scene after one of the scenario's edits.

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
    """A scenario by a known name or by the path of a file.

    Raises:
        InvalidInput: unknown scenario, unreadable file, or a field at fault.
    """
    return parse_scenario(read_toml(scenario, known_scenarios(), "scenario"))


def parse_scenario(data: dict[str, Any]) -> Scenario:
    """A scenario from the content of its file; options may have their old names.

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
    """The known robot whose name a name is nearly, but is not."""
    known = known_robots()
    if name in known:
        return None
    # Another number is another robot.
    numbered = [other for other in known if _digits(other) == _digits(name)]
    return next(iter(get_close_matches(name.lower(), numbered, 1, SLIP)), None)


def _digits(name: str) -> list[str]:
    return [letter for letter in name if letter.isdigit()]


def _placement(text: PoseText, field: str) -> Placement:
    return Placement.parse(text.position, text.orientation, field)


def _bounds(text: BoundsText) -> RootBounds:
    for axis in ("x", "y", "z"):
        low, high = getattr(text, axis)
        if low > high:
            reason = "is empty: the first is over the second"
            raise InvalidInput(f"request.bounds.{axis}", [low, high], reason)
    box = np.array([text.x, text.y, text.z])
    return RootBounds(box[:, 0], box[:, 1], np.array([text.yaw, text.pitch, text.roll]))


def _goal_limbs(robot: Robot, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
    return None if names is None else limb_names(robot, names, "request.goal_limbs")


def _limbs(robot: Robot, names: tuple[str, ...] | None, field: str) -> tuple[str, ...]:
    """Names of limbs, all of the robot's where none are given."""
    if names is None:
        return tuple(limb.name for limb in robot.limbs)
    return limb_names(robot, names, field)
