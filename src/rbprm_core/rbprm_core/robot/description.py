"""The robot description file (TOML), which holds all data of a robot beside its URDF and SRDF.

A robot is added by adding a file; `docs/robot_file.md` documents every key.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rbprm_core.errors import InvalidInput
from rbprm_core.files import known_files, read_toml
from rbprm_core.surface_kind import SurfaceKind
from rbprm_core.validation import FILE_NAME, Record, one_of, parse_record

MAX_SIZE = 10.0  # metres; limit on the size of a foot
MAX_SCALE = 10.0  # limit on the scale of the trunk volume
MAX_WEIGHT = 1e6  # limit on the weight of a heuristic

Positive = Annotated[float, Field(gt=0, le=MAX_SIZE)]
Names = Annotated[tuple[str, ...], Field(min_length=1)]
Weight = Annotated[float, Field(ge=-MAX_WEIGHT, le=MAX_WEIGHT)]
Weights = Annotated[dict[str, Weight], Field(min_length=1)]


class PointContact(Record):
    """A ball foot, or a part of a ball, such as the front of a knee.

    Attributes:
        type: "point".
        radius: radius of the ball, metres; the contact point lies one radius from its centre.
        center: centre of the ball in the effector frame, metres.
        axis: direction from the ball's centre to the middle of the part that makes contact, in the
            effector frame; its length does not matter.
        angle: angle between the axis and the outermost direction of that part, radians; pi for the
            whole ball.
    """

    type: Literal["point"]
    radius: Annotated[float, Field(ge=0, le=MAX_SIZE)]
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, -1.0)
    angle: Annotated[float, Field(gt=0, le=math.pi)] = math.pi


class PlanarContact(Record):
    """A flat rectangular patch, such as a sole.

    The origin of the contact frame is the middle of the patch; its z axis points away from the
    surface.

    Attributes:
        type: "planar".
        half_size: half the sides of the patch along its x and y axes, metres.
        position: origin of the contact frame in the effector frame, metres.
        orientation: unit quaternion [x, y, z, w] of the contact frame in the effector frame.
    """

    type: Literal["planar"]
    half_size: tuple[Positive, Positive]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


class LimbDescription(Record):
    """One limb.

    Attributes:
        name: name of the limb.
        first_joint: name of the limb's joint nearest to the root.
        effector: name of the frame in the URDF that the contact is fixed to.
        contact: the part of the effector that makes contact.
        surfaces: kinds of surface that the limb may be in contact with.
        root_pitch: smallest and largest pitch of the root (about y), radians, that a patch's
            samples are made for: half of them anywhere in this range, half with the root nearly
            upright.
        heuristics: weight by name of heuristic; the weighted sum ranks contact candidates.
        samples: largest number of samples in the database (N of Tonneau et al. 2018, section 4.1).
    """

    name: str
    first_joint: str
    effector: str
    contact: Annotated[PointContact | PlanarContact, Field(discriminator="type")]
    surfaces: Annotated[tuple[SurfaceKind, ...], Field(min_length=1)] = (SurfaceKind.SUPPORT,)
    root_pitch: tuple[float, float] = (0.0, 0.0)
    heuristics: Weights = {"manipulability": 1.0}
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 10_000


class VolumeSettings(Record):
    """Settings of the volumes of the reachability condition (Tonneau et al. 2018, appendix A).

    Attributes:
        trunk_links: names of the links whose collision geometry makes the trunk volume $W^0$.
        trunk_scale: scaling factor $s$ of the trunk volume (section 3.2 there).
        samples: number of configurations drawn for each reachable workspace (N of appendix A.1).
        faces: largest number of faces of a simplified workspace (38 in appendix A.1).
    """

    trunk_links: Names
    trunk_scale: Annotated[float, Field(ge=1, le=MAX_SCALE)] = 1.2
    samples: Annotated[int, Field(ge=1000, le=10_000_000)] = 50_000
    faces: Annotated[int, Field(ge=4, le=10_000)] = 38


class RobotDescription(Record):
    """A robot as the planner uses it.

    Attributes:
        name: name of the robot.
        urdf: path of the URDF, relative to a `share` folder or absolute.
        srdf: path of the SRDF, likewise; None for a robot without one.
        reference_posture: name of a group state of the SRDF, or joint positions by joint name,
            radians or metres; joints not named are at 0.
        root_joints: names of the joints planned with the root (r > 6 in Tonneau et al. 2018,
            section 2.3).
        joint_ranges: lower and upper limit by joint name, radians or metres, narrower than the
            URDF's; for joints that the URDF allows several turns, or for a knee that must not flip.
        volumes: settings of the volumes of the reachability condition.
        limbs: all limbs that can be used; two of them may share joints, as a foot and a knee do.
        default_limbs: names of the limbs used where a request names none; None for all.
        seed: seed of the random samples; a part of the key of the cached robot data.
    """

    name: Annotated[str, Field(pattern=FILE_NAME)]
    urdf: str
    srdf: str | None = None
    reference_posture: str | dict[str, float]
    root_joints: tuple[str, ...] = ()
    joint_ranges: dict[str, tuple[float, float]] = {}
    volumes: VolumeSettings
    limbs: Annotated[tuple[LimbDescription, ...], Field(min_length=1)]
    default_limbs: Names | None = None
    seed: Annotated[int, Field(ge=0)] = 0

    @model_validator(mode="after")
    def _unique_limbs(self) -> RobotDescription:
        names = [limb.name for limb in self.limbs]
        if len(set(names)) != len(names):
            raise ValueError(f"limb names must differ, got {', '.join(names)}")
        for joint, (low, high) in self.joint_ranges.items():
            if low >= high:
                raise ValueError(f"joint_ranges.{joint} is empty: [{low:g}, {high:g}]")
        for name in self.default_limbs or ():
            if name not in names:
                raise ValueError(f"default_limbs names {name}; known: {', '.join(names)}")
        return self

    def using(
        self, limbs: Sequence[str] | None = None, root_joints: Sequence[str] | None = None
    ) -> RobotDescription:
        """The robot with some of its limbs; the joints of the others keep the reference posture.

        Args:
            limbs: names of limbs; None for the description's default limbs.
            root_joints: names of joints to plan with the root; None for the description's.

        Raises:
            InvalidInput: an unknown limb, a limb named twice, or none.
        """
        known = tuple(limb.name for limb in self.limbs)
        chosen = limbs if limbs is not None else self.default_limbs or known
        if not chosen:
            raise InvalidInput("limbs", [], "names no limb")
        names = {one_of("limbs", name, known) for name in chosen}
        if len(names) < len(chosen):
            raise InvalidInput("limbs", list(chosen), "names a limb twice")
        changed = {
            "limbs": tuple(limb for limb in self.limbs if limb.name in names),
            "default_limbs": None,
            "root_joints": self.root_joints if root_joints is None else tuple(root_joints),
        }
        return self.model_copy(update=changed)

    def with_heuristics(self, heuristics: Mapping[str, Mapping[str, float]]) -> RobotDescription:
        """The robot with other heuristics for some of its limbs.

        Args:
            heuristics: weights by name of heuristic, by name of limb; other limbs keep theirs.

        Raises:
            InvalidInput: an unknown limb.
        """
        return self._changed("heuristics", {k: dict(v) for k, v in heuristics.items()})

    def with_surfaces(self, surfaces: Mapping[str, tuple[SurfaceKind, ...]]) -> RobotDescription:
        """The robot with other kinds of surface for some of its limbs.

        Args:
            surfaces: kinds of surface by name of limb; other limbs keep theirs.

        Raises:
            InvalidInput: an unknown limb.
        """
        return self._changed("surfaces", surfaces)

    def with_trunk(self, links: tuple[str, ...] | None, scale: float | None) -> RobotDescription:
        """The robot with another trunk volume $W^0$.

        Args:
            links: names of the links whose boxes make the volume; None keeps the description's.
            scale: scaling factor $s$; None keeps the description's.
        """
        volumes = self.volumes
        changed = {
            "trunk_links": volumes.trunk_links if links is None else links,
            "trunk_scale": volumes.trunk_scale if scale is None else scale,
        }
        return self.model_copy(update={"volumes": volumes.model_copy(update=changed)})

    def _changed(self, field: str, values: Mapping[str, object]) -> RobotDescription:
        """The robot with another value of a field for some limbs, by their names."""
        known = tuple(limb.name for limb in self.limbs)
        chosen = {one_of(field, name, known): value for name, value in values.items()}
        limbs = tuple(
            limb.model_copy(update={field: chosen[limb.name]}) if limb.name in chosen else limb
            for limb in self.limbs
        )
        return self.model_copy(update={"limbs": limbs})


def known_robots() -> dict[str, Path]:
    """File by name of robot, for the robots that come with the package."""
    return known_files("rbprm_core.robot", "descriptions")


def load_description(robot: str) -> RobotDescription:
    """The description of a robot.

    Args:
        robot: a known name, or the path of a robot file.

    Raises:
        InvalidInput: an unknown robot, an unreadable file, or an invalid field.
    """
    return parse_record(RobotDescription, read_toml(robot, known_robots(), "robot"), "robot")
