"""The robot description file (TOML): all that the algorithms know of a robot.

Adding a robot means adding a file; `docs/robot_file.md` documents every key.
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

MAX_SIZE = 10.0  # metres of a foot
MAX_SCALE = 10.0  # of the trunk volume
MAX_WEIGHT = 1e6  # of a heuristic

Positive = Annotated[float, Field(gt=0, le=MAX_SIZE)]
Names = Annotated[tuple[str, ...], Field(min_length=1)]
Weight = Annotated[float, Field(ge=-MAX_WEIGHT, le=MAX_WEIGHT)]
Weights = Annotated[dict[str, Weight], Field(min_length=1)]


class PointContact(Record):
    """A ball foot, or a part of a ball, such as the front of a knee.

    Attributes:
        radius: of the ball in metres; the contact point lies one radius from its centre.
        center: of the ball in the effector frame, metres.
        axis: from the ball's centre to the middle of the part that makes contact, in the effector
            frame; of any length.
        angle: between the axis and the outermost direction of that part, radians; pi for the whole
            ball.
    """

    type: Literal["point"]
    radius: Annotated[float, Field(ge=0, le=MAX_SIZE)]
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, -1.0)
    angle: Annotated[float, Field(gt=0, le=math.pi)] = math.pi


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
        root_pitch: of the root (about y, radians) for which a patch's samples are made: half of
            them anywhere in this range, half with the root nearly upright.
        heuristics: name of heuristic to weight; the weighted sum ranks contact candidates.
        samples: size of the sample database (N of section 4.1).
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
    """How the volumes of appendix A are made.

    Attributes:
        trunk_links: links whose collision geometry makes the trunk volume W0.
        trunk_scale: the factor s of section 3.2.
        samples: configurations drawn for each reachable workspace (N of appendix A.1).
        faces: most faces of a simplified workspace (the paper: 38).
    """

    trunk_links: Names
    trunk_scale: Annotated[float, Field(ge=1, le=MAX_SCALE)] = 1.2
    samples: Annotated[int, Field(ge=1000, le=10_000_000)] = 50_000
    faces: Annotated[int, Field(ge=4, le=10_000)] = 38


class RobotDescription(Record):
    """A robot as the planner sees it.

    Attributes:
        urdf, srdf: paths relative to a `share` folder, or absolute.
        reference_posture: name of an SRDF group state, or joint values in radians by joint name.
        root_joints: joints planned with the root (r > 6 in section 2.3).
        limbs: all that the robot may use; two of them may share joints, as a foot and a knee do.
        default_limbs: names of the limbs used where nothing else is said; None for all.
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
        """The robot with some of its limbs; what hangs on the others keeps the reference posture.

        Args:
            limbs: names; the description's own choice where None. root_joints: likewise.

        Raises:
            InvalidInput: a limb that the robot does not have.
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

    def ranked_by(self, heuristics: Mapping[str, Mapping[str, float]]) -> RobotDescription:
        """The robot with other heuristics for some of its limbs.

        Args:
            heuristics: name of heuristic to weight, by name of limb; the other limbs keep theirs.

        Raises:
            InvalidInput: a limb that the robot does not have.
        """
        return self._changed("heuristics", {k: dict(v) for k, v in heuristics.items()})

    def touching(self, surfaces: Mapping[str, tuple[SurfaceKind, ...]]) -> RobotDescription:
        """The robot with other kinds of surface for some of its limbs.

        Args:
            surfaces: kinds by name of limb; the other limbs keep theirs.

        Raises:
            InvalidInput: a limb that the robot does not have.
        """
        return self._changed("surfaces", surfaces)

    def bulky(self, links: tuple[str, ...] | None, scale: float | None) -> RobotDescription:
        """The robot with another trunk volume W0.

        Args:
            links: whose boxes make it, scale: the factor s; as they are where None.
        """
        volumes = self.volumes
        changed = {
            "trunk_links": volumes.trunk_links if links is None else links,
            "trunk_scale": volumes.trunk_scale if scale is None else scale,
        }
        return self.model_copy(update={"volumes": volumes.model_copy(update=changed)})

    def _changed(self, field: str, values: Mapping[str, object]) -> RobotDescription:
        """The robot with another value of a field for the limbs named."""
        known = tuple(limb.name for limb in self.limbs)
        chosen = {one_of(field, name, known): value for name, value in values.items()}
        limbs = tuple(
            limb.model_copy(update={field: chosen[limb.name]}) if limb.name in chosen else limb
            for limb in self.limbs
        )
        return self.model_copy(update={"limbs": limbs})


def known_robots() -> dict[str, Path]:
    """Names of the robots that come with the package, and their files."""
    return known_files("rbprm_core.robot", "descriptions")


def load_description(robot: str) -> RobotDescription:
    """The description of a robot given by a known name or by the path of a file.

    Raises:
        InvalidInput: unknown robot, unreadable file, or a field at fault.
    """
    return parse_record(RobotDescription, read_toml(robot, known_robots(), "robot"), "robot")
