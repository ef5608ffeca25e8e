"""The robot description file (TOML): all that the algorithms know of a robot.

Adding a robot means adding a file; `docs/robot_file.md` documents every key.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rbprm_core.files import known_files, read_toml
from rbprm_core.validation import FILE_NAME, Record, parse_record
from rbprm_core.vocabulary import SurfaceKind

Positive = Annotated[float, Field(gt=0)]
Names = Annotated[tuple[str, ...], Field(min_length=1)]


class PointContact(Record):
    """A ball foot.

    Attributes:
        radius: of the ball in metres; the contact point lies one radius from its centre.
        center: of the ball in the effector frame, metres.
    """

    type: Literal["point"]
    radius: Annotated[float, Field(ge=0)]
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)


class PlanarContact(Record):
    """A flat rectangular patch, such as a sole.

    Attributes:
        half_size: of the patch along its x and y axes, metres.
        position, orientation: of the contact frame in the effector frame, metres and unit
            quaternion [x, y, z, w]; its origin is the middle of the patch, its z axis points away
            from the surface.
    """

    type: Literal["planar"]
    half_size: tuple[Positive, Positive]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


class LimbDescription(Record):
    """One limb.

    Attributes:
        first_joint: name of the limb's joint nearest to the root.
        effector: frame of the URDF that makes contact.
        surfaces: kinds of surface that the limb may use.
        heuristics: name of heuristic to weight; the weighted sum ranks contact candidates.
        samples: size of the sample database (N of section 4.1).
    """

    name: str
    first_joint: str
    effector: str
    contact: Annotated[PointContact | PlanarContact, Field(discriminator="type")]
    surfaces: Annotated[tuple[SurfaceKind, ...], Field(min_length=1)] = (SurfaceKind.SUPPORT,)
    heuristics: dict[str, float] = {"manipulability": 1.0}
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 10_000


class VolumeSettings(Record):
    """How the volumes of appendix A are made.

    Attributes:
        trunk_links: links whose collision geometry makes the trunk volume W0.
        trunk_scale: the factor s of section 3.2.
        samples: configurations drawn for each reachable workspace (N of appendix A.1).
        faces: most faces of a simplified workspace (the paper: 38).
    """

    trunk_links: Names
    trunk_scale: Annotated[float, Field(ge=1)] = 1.2
    samples: Annotated[int, Field(ge=1000, le=10_000_000)] = 50_000
    faces: Annotated[int, Field(ge=4)] = 38


class RobotDescription(Record):
    """A robot as the planner sees it.

    Attributes:
        urdf, srdf: paths relative to a `share` folder, or absolute.
        reference_posture: name of an SRDF group state, or joint values in radians by joint name.
        root_joints: joints planned with the root (r > 6 in section 2.3).
        joint_ranges: narrower limits in radians by joint name, where the URDF's are no help
            (several turns) or where a knee must not flip.
        seed: of the random samples; part of the robot data's key.
    """

    name: Annotated[str, Field(pattern=FILE_NAME)]
    urdf: str
    srdf: str | None = None
    reference_posture: str | dict[str, float]
    root_joints: tuple[str, ...] = ()
    joint_ranges: dict[str, tuple[float, float]] = {}
    volumes: VolumeSettings
    limbs: Annotated[tuple[LimbDescription, ...], Field(min_length=1)]
    seed: Annotated[int, Field(ge=0)] = 0

    @model_validator(mode="after")
    def _unique_limbs(self) -> RobotDescription:
        names = [limb.name for limb in self.limbs]
        if len(set(names)) != len(names):
            raise ValueError(f"limb names must differ, got {', '.join(names)}")
        for joint, (low, high) in self.joint_ranges.items():
            if low >= high:
                raise ValueError(f"joint_ranges.{joint} is empty: [{low:g}, {high:g}]")
        return self


def known_robots() -> dict[str, Path]:
    """Names of the robots that come with the package, and their files."""
    return known_files("rbprm_core.robot", "descriptions")


def load_description(robot: str) -> RobotDescription:
    """The description of a robot given by a known name or by the path of a file.

    Raises:
        InvalidInput: unknown robot, unreadable file, or a field at fault.
    """
    return parse_record(RobotDescription, read_toml(robot, known_robots(), "robot"), "robot")
