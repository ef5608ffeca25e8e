"""The parts of a contact plan, as they stand in its file."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from rbprm_core.validation import Friction

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class PlanRecord(BaseModel):
    """A frozen part of a plan; extra keys are kept, non-finite numbers refused."""

    model_config = ConfigDict(frozen=True, extra="allow", allow_inf_nan=False)


class Pose(PlanRecord):
    """A position and an orientation.

    Attributes:
        position: (3,) metres.
        orientation: (4,) unit quaternion [x, y, z, w].
    """

    position: Vector3
    orientation: Quaternion


class RobotEntry(PlanRecord):
    """The robot of a plan.

    Attributes:
        name: name of the robot.
        urdf: path of the URDF, relative to the `share` folder of the package that ships it.
        srdf: path of the SRDF, likewise; None where the robot has none.
        joint_names: names of the joints, in the order of the joints of every state.
        root_frame: link of the URDF that the poses of the root describe; "" in files of version 1.
        root_joints: names of the joints planned with the root, in the order of a guide node's.
        description: content of the robot file with the choices of limbs, heuristics, surfaces and
            trunk that the plan was made with, see `rbprm_core.robot.description`; None where it is
            not known, as in files of version 1.
    """

    name: str
    urdf: str
    srdf: str | None = None
    joint_names: tuple[str, ...]
    root_frame: str = ""
    root_joints: tuple[str, ...] = ()
    description: dict[str, Any] | None = None


class MeshEntry(PlanRecord):
    """A mesh of the environment.

    Attributes:
        file: path of the mesh, relative to a `share` folder or absolute.
        translation: (3,) position of the mesh's origin, metres.
        rotation: (3, 3) rotation matrix, by rows.
        friction: coefficient of Coulomb friction of all its surfaces.
    """

    file: str
    translation: Vector3 = (0.0, 0.0, 0.0)
    rotation: tuple[Vector3, Vector3, Vector3] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    friction: Friction = 0.5


class SurfaceEntry(PlanRecord):
    """A planar polygon of the environment.

    Attributes:
        id: unique id.
        vertices: (v, 3) outer boundary, counter-clockwise seen from outside, metres.
        holes: boundaries (h, 3) of the holes, metres.
        friction: coefficient of Coulomb friction.
    """

    id: str
    vertices: tuple[Vector3, ...]
    holes: tuple[tuple[Vector3, ...], ...] = ()
    friction: Friction = 0.5


class ClassificationEntry(PlanRecord):
    """How normals decided what the surfaces were used for, see `rbprm_core.scene.Classification`.

    Attributes:
        support: bound on the squared distance between a unit normal and z of a support surface.
        lean: bound on the absolute z component of the unit normal of a surface to lean on.
        min_area: area under which a surface is only an obstacle, square metres.
    """

    support: float
    lean: float
    min_area: float


class EnvironmentEntry(PlanRecord):
    """The environment that a plan was made in.

    Attributes:
        name: name of the environment.
        meshes: meshes, which are cut into surfaces.
        surfaces: polygons, beside those of the meshes.
        classification: how surfaces were classified; None where that is not known, as in files of
            version 1, or where the defaults were used.
    """

    name: str = ""
    meshes: tuple[MeshEntry, ...] = ()
    surfaces: tuple[SurfaceEntry, ...] = ()
    classification: ClassificationEntry | None = None


class GuideNode(Pose, from_attributes=True):
    """A node of the guide: the pose of the root and the joints planned with it.

    Attributes:
        joints: (j,) values of `RobotEntry.root_joints`, radians or metres; empty in files of
            version 1.
    """

    joints: tuple[float, ...] = ()


class ContactEntry(PlanRecord):
    """A contact of a limb.

    Attributes:
        limb: name of the limb.
        frame: frame of the URDF that moves with the contact.
        frame_offset: pose of the contact frame in `frame`.
        type: "point", or "planar" for a rectangular patch.
        position: (3,) origin of the contact frame: contact point or middle of the patch, metres.
        orientation: (4,) orientation of the contact frame, whose z axis is the normal.
        normal: (3,) outward unit normal of the surface.
        points: (k, 3) points that carry forces: 1, or the 4 corners of the patch, metres.
        friction: coefficient of Coulomb friction.
        surface: id of the surface; "" where it is not known.
        spot: name of the limb's contact spot; "" for its first one.
    """

    limb: str
    frame: str
    frame_offset: Pose = Pose(position=(0, 0, 0), orientation=(0, 0, 0, 1))
    type: Literal["point", "planar"]
    position: Vector3
    orientation: Quaternion
    normal: Vector3
    points: tuple[Vector3, ...]
    friction: Friction
    surface: str = ""
    spot: str = ""


class StateEntry(PlanRecord):
    """A whole-body configuration with its contacts.

    Attributes:
        root: pose of the root.
        joints: (n,) values of `RobotEntry.joint_names`, radians or metres.
        com: (3,) centre of mass, metres.
        robustness: raw b0, newtons.
        contacts: contacts of the limbs, the oldest first.
    """

    root: Pose
    joints: tuple[float, ...]
    com: Vector3
    robustness: float
    contacts: tuple[ContactEntry, ...]


class TransitionEntry(PlanRecord):
    """The change of contacts from one state to the next.

    Attributes:
        limb: name of the limb whose contact changes; "" where none does.
        action: "none", "make", "break" or "move".
        witnesses: postures at lift-off and touch-down that show that the transition can be
            executed; empty where none were computed.
    """

    limb: str = ""
    action: Literal["none", "make", "break", "move"] = "none"
    witnesses: tuple[dict[str, Any], ...] = ()


class Statistics(PlanRecord):
    """How a plan was made.

    Attributes:
        time: seconds by stage; a part of a stage has the stage's name before a dot.
        counts: counts by name.
        versions: versions by package.
    """

    time: dict[str, float] = {}
    counts: dict[str, int] = {}
    versions: dict[str, str] = {}
