"""The library for users: robots, scenes and plans, with defaults for everything else.

`import rbprm_core as rbprm` gives these names; see there for what is stable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget, Progress
from rbprm_core.check import CheckReport, check_plan
from rbprm_core.environment import environment_classification, load_scene, polygon_entry
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.root_bounds import BoundsRule, derived_bounds
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import (
    ClassificationEntry,
    ContactPlan,
    EnvironmentEntry,
    MeshEntry,
    StateEntry,
    Statistics,
    SurfaceEntry,
)
from rbprm_core.planner import plan as run_planner
from rbprm_core.request import GRAVITY, PlannerOptions, PlanRequest, StageNames, read_options
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scene import Classification, Surface
from rbprm_core.scene import Scene as SurfaceScene
from rbprm_core.validation import coordinates, naming_fields, parse_record

MAX_ROBOTS = 4  # robots whose data are kept in memory

Pose: TypeAlias = Placement | ArrayLike
"""A pose of the root: a position (3,), a position with a quaternion (7,) as [x, y, z, qx, qy, qz,
qw], a `Placement`, or a pinocchio SE3."""


def load_robot(
    robot: str | Path,
    limbs: Sequence[str] | None = None,
    root_joints: Sequence[str] | None = None,
) -> Robot:
    """The robot of a known name or of a robot file.

    Args:
        robot: a name that `rbprm robots` lists, or the path of a robot file.
        limbs: names of the limbs that may make contact; the robot file's choice where None.
        root_joints: names of the joints planned with the root; the robot file's where None.

    Raises:
        InvalidInput: an unknown robot, limb or joint, or a field of the file at fault.
    """
    return Robot.load(load_description(str(robot)).using(limbs, root_joints))


class Scene(SurfaceScene):
    """Contact surfaces that know the files or polygons they come from.

    Made by `from_mesh` and `from_polygons`.

    Args:
        surfaces: contact surfaces with unique ids.
        environment: what the surfaces come from, as a plan file holds it; polygons of the surfaces
            themselves where None.

    Attributes:
        environment: what the surfaces come from, as a plan file holds it.
    """

    def __init__(
        self, surfaces: Iterable[Surface], environment: EnvironmentEntry | None = None
    ) -> None:
        super().__init__(surfaces)
        self.environment = polygon_entry(self, "") if environment is None else environment

    def edited(self, changed: Iterable[Surface] = (), removed: Iterable[str] = ()) -> Scene:
        """The scene with surfaces added, replaced or removed; it is kept as polygons in plan files.

        Args:
            changed: surfaces to add, or to put in the place of those with the same id.
            removed: ids of surfaces to remove.

        Raises:
            InvalidInput: no surface has an id that is to be removed, or the scene gets empty.
        """
        return Scene(super().edited(changed, removed).surfaces)

    @staticmethod
    def from_mesh(
        file: str | Path,
        *,
        friction: float = 0.5,
        translation: ArrayLike = (0.0, 0.0, 0.0),
        rotation: ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        classification: Classification | None = None,
    ) -> Scene:
        """The contact surfaces of a triangle mesh, with coplanar neighbouring facets joined.

        Args:
            file: path of the mesh (STL, OBJ, DAE, ...), in metres and with z up; or its name
                relative to a `share` folder.
            friction: coefficient of Coulomb friction of all surfaces.
            translation: (3,) position of the mesh's origin in the planning frame, metres.
            rotation: (3, 3) rotation matrix of the mesh in the planning frame.
            classification: how normals decide what a surface is used for.

        Raises:
            InvalidInput: a mesh that cannot be used.
        """
        path = Path(file)
        mesh = {
            "file": str(path.absolute() if path.is_file() else file),
            "translation": np.asarray(translation).tolist(),
            "rotation": np.asarray(rotation).tolist(),
            "friction": friction,
        }
        entry = EnvironmentEntry(name=path.stem, meshes=(parse_record(MeshEntry, mesh),))
        with naming_fields({f"environment.meshes.0.{name}": name for name in mesh}):
            return Scene.from_environment(entry, classification)

    @staticmethod
    def from_polygons(
        polygons: Mapping[str, ArrayLike] | Iterable[ArrayLike],
        *,
        friction: float = 0.5,
        classification: Classification | None = None,
        name: str = "",
    ) -> Scene:
        """Contact surfaces of planar polygons.

        Args:
            polygons: vertices (v, 3) of each polygon in metres, counter-clockwise seen from the
                side that carries contacts; by id, or without ids, which are then "surface_0", ...
            friction: coefficient of Coulomb friction of all surfaces.
            classification: how normals decide what a surface is used for.
            name: name of the scene in plan files and pages.

        Raises:
            InvalidInput: a polygon that cannot be used.
        """
        if not isinstance(polygons, Mapping):
            polygons = {f"surface_{i}": vertices for i, vertices in enumerate(polygons)}
        surfaces, fields = [], {}
        for i, (key, vertices) in enumerate(polygons.items()):
            points = coordinates(f"polygons.{key}", vertices, (-1, 3)).tolist()
            data = {"id": key, "vertices": points, "friction": friction}
            with naming_fields({"friction": "friction"}, f"polygons.{key}."):
                surfaces.append(parse_record(SurfaceEntry, data))
            fields[f"environment.surfaces.{i}"] = f"polygons.{key}"
            fields[f"environment.surfaces.{i}.vertices"] = f"polygons.{key}"
        entry = EnvironmentEntry(name=name, surfaces=tuple(surfaces))
        with naming_fields(fields):
            return Scene.from_environment(entry, classification)

    @staticmethod
    def from_environment(
        environment: EnvironmentEntry, classification: Classification | None = None
    ) -> Scene:
        """The contact surfaces of meshes and polygons together.

        Args:
            environment: meshes and polygons, as a plan file holds them.
            classification: how normals decide what a surface is used for; the environment's where
                None.

        Raises:
            InvalidInput: a mesh or polygon that cannot be used.
        """
        if classification is None:
            classification = environment_classification(environment)
        kept = {"classification": ClassificationEntry(**asdict(classification))}
        surfaces = load_scene(environment, classification).surfaces
        return Scene(surfaces, environment.model_copy(update=kept))


class Plan:
    """A contact plan: the states of a robot from start to goal.

    Attributes:
        record: the plan as its file holds it.
    """

    def __init__(self, record: ContactPlan) -> None:
        self.record = record

    def __repr__(self) -> str:
        name, states = self.record.robot.name, len(self.states)
        return f"<Plan of {name} in {states} states>"

    @property
    def states(self) -> tuple[StateEntry, ...]:
        """The contact states from start to goal."""
        return self.record.states

    @property
    def guide(self) -> Array:
        """Nodes of the guide (n, 7 + j): position in metres, quaternion [x, y, z, w], and the j
        joints planned with the root."""
        return np.array(
            [[*node.position, *node.orientation, *node.joints] for node in self.record.guide]
        )

    @property
    def statistics(self) -> Statistics:
        """Seconds by stage, counts, and versions of the packages that took part."""
        return self.record.statistics

    def configurations(self) -> Array:
        """Configurations (states, nq) as pinocchio has them with a free-flyer root.

        The position of the root in metres, its quaternion [x, y, z, w], and the joints in the
        order of `record.robot.joint_names`, radians or metres.
        """
        return np.array(
            [[*s.root.position, *s.root.orientation, *s.joints] for s in self.record.states]
        )

    def check(self) -> CheckReport:
        """What the independent check says of the plan; `valid` is True where nothing is wrong.

        Raises:
            InvalidInput: files of the robot or of the environment that cannot be read.
        """
        return check_plan(self.record)

    def save(self, path: str | Path) -> None:
        """Write the plan file.

        Args:
            path: file to write, in a folder that exists.

        Raises:
            InvalidInput: the file cannot be written.
        """
        self.record.write(path)

    @staticmethod
    def load(path: str | Path) -> Plan:
        """The plan in a plan file.

        Args:
            path: file to read.

        Raises:
            InvalidInput: not a plan file; names the field at fault.
        """
        return Plan(ContactPlan.read(path))

    def show(self, path: str | Path) -> None:
        """Write a self-contained HTML page that shows the plan in motion, or a picture of it.

        Args:
            path: file to write: a picture if it ends in .png, else a page.

        Raises:
            InvalidInput: the plan cannot be shown, or the file cannot be written.
        """
        # Imported here: k3d and matplotlib take a second that planning need not wait for.
        if Path(path).suffix == ".png":
            from rbprm_core.view.picture import write_picture

            write_picture(self.record, path)
        else:
            from rbprm_core.view.page import write_page

            write_page(self.record, path)


def plan(
    robot: Robot | str | Path,
    scene: SurfaceScene,
    start: Pose,
    goal: Pose,
    *,
    seed: int = 0,
    time_limit: float = 60.0,
    robustness_threshold: float = 0.0,
    bounds: RootBounds | None = None,
    required_limbs: Sequence[str] | None = None,
    start_limbs: Sequence[str] | None = None,
    goal_limbs: Sequence[str] | None = None,
    gravity: ArrayLike | None = None,
    guide: str = "rrt",
    contacts: str = "along_guide",
    options: PlannerOptions | Mapping[str, Any] | None = None,
    report: Callable[[Progress], None] | None = None,
) -> Plan:
    """Plan a contact sequence; the same arguments give the same plan.

    The first plan of a robot computes its workspaces and sample databases, which takes up to a
    minute; they are kept on disk, and the time limit starts after that.

    Args:
        robot: the robot, its name, or the path of its file.
        scene: the contact surfaces.
        start: pose of the root at the start: (3,) position in metres, (7,) with a quaternion
            [x, y, z, w] after it, a `Placement` or a pinocchio SE3.
        goal: pose of the root at the goal, likewise.
        seed: seed of the random generator.
        time_limit: longest planning time, seconds.
        robustness_threshold: minimum raw b0 of every state, newtons; 0 for static equilibrium
            without a margin.
        bounds: where the root may be; where None, 1 m around the box of start, goal and scene, and
            as far as start and goal are turned, but at least 0.4 rad of yaw and 0.3 rad of pitch
            and roll.
        required_limbs: names of the limbs whose workspace must meet a surface all along the guide;
            all limbs where None.
        start_limbs: names of the limbs in contact at the start; all limbs where None.
        goal_limbs: names of the limbs that are to be in contact in the last state; any where None.
        gravity: (3,) gravity, m/s^2; (0, 0, -9.81) where None.
        guide: name of the guide planner.
        contacts: name of the contact planner.
        options: options of the planner, as `PlannerOptions` or as nested tables of those that
            differ from the defaults: {"sequence": {"step": 0.05}}.
        report: called with the progress of planning.

    Raises:
        InvalidInput: an argument that cannot be used; names it.
        StartUnreachable: the start admits no contact configuration.
        GoalUnreachable: the goal admits no contact configuration.
        NoGuideFound: no guide leads from start to goal.
        NoSequenceFound: no contact sequence follows a guide.
        TimeLimitReached: the time limit ran out.
    """
    robot = robot if isinstance(robot, Robot) else load_robot(robot)
    limbs = [limb.name for limb in robot.limbs]
    ends = _placement(start, "start"), _placement(goal, "goal")
    request = PlanRequest(
        start=ends[0],
        goal=ends[1],
        bounds=derived_bounds(ends, scene.surfaces, BoundsRule()) if bounds is None else bounds,
        required_limbs=tuple(limbs if required_limbs is None else required_limbs),
        start_limbs=tuple(limbs if start_limbs is None else start_limbs),
        robustness_threshold=robustness_threshold,
        seed=seed,
        gravity=GRAVITY.copy() if gravity is None else np.asarray(gravity),
        goal_limbs=None if goal_limbs is None else tuple(goal_limbs),
        options=_options(options),
        stages=StageNames(guide, contacts),
        time_limit=time_limit,
    ).validated(limbs)
    data = _robot_data(robot)
    outcome = run_planner(request, data, scene, Budget(time_limit, report=report))
    environment = scene.environment if isinstance(scene, Scene) else polygon_entry(scene, "")
    return Plan(contact_plan(outcome, request, robot, environment))


@lru_cache(maxsize=MAX_ROBOTS)
def _robot_data(robot: Robot) -> RobotData:
    return load_robot_data(robot)


def _options(options: PlannerOptions | Mapping[str, Any] | None) -> PlannerOptions:
    if options is None or isinstance(options, PlannerOptions):
        return PlannerOptions() if options is None else options
    return read_options(options)


def _placement(pose: Pose, field: str) -> Placement:
    """A pose in one of the forms that a user may give it in."""
    if isinstance(pose, Placement):
        return Placement.parse(pose.position, pose.orientation, field)
    if isinstance(pose, pin.SE3):
        return Placement.of(pose)
    try:
        values = np.array(pose, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(field, pose, "must be an array of numbers") from error
    if values.shape not in ((3,), (7,)):
        reason = f"must have 3 numbers, or 7 with a quaternion, has shape {values.shape}"
        raise InvalidInput(field, pose, reason)
    orientation = values[3:] if len(values) == 7 else (0.0, 0.0, 0.0, 1.0)
    return Placement.parse(values[:3], orientation, field)
