"""A limb: the joints from the root to an effector that makes contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.robot.description import LimbDescription, PointContact
from rbprm_core.robot.kinematics import LimbKinematics
from rbprm_core.surface_kind import SurfaceKind

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Limb:
    """One limb R^k of the robot (section 2.3).

    Attributes:
        name: of the limb. effector: name of the URDF frame that makes contact.
        base: id of the joint the limb hangs on; workspaces and samples are in its frame.
        joints: (n,) ids of the limb's joints, from the base outwards.
        q_index: (n,) their places in the configuration vector.
        low, high: (n,) joint limits in radians or metres.
        frame: id of the effector frame. contact: placement of the contact frame in it: the ball's
            centre, or the middle of the patch; its z axis points from the surface into the body.
        radius: of the ball around the centre, metres; 0 for a patch.
        half_size: (2,) of the patch, metres; None for a ball.
        facing: least cosine of the angle between the contact frame's z axis and a surface's normal
            for a part of a ball; -1 for a whole ball, and for a patch, which is turned onto it.
        kinematics: of the contact frame in the base frame, on the limb's joints alone.
    """

    name: str
    effector: str
    base: int
    joints: NDArray[np.int_]
    q_index: NDArray[np.int_]
    low: Array
    high: Array
    frame: int
    contact: pin.SE3
    radius: float
    half_size: Array | None
    facing: float
    kinematics: LimbKinematics
    surfaces: tuple[SurfaceKind, ...]
    root_pitch: tuple[float, float]
    heuristics: dict[str, float]
    samples: int

    @property
    def planar(self) -> bool:
        """True where the limb makes planar contacts."""
        return self.half_size is not None

    @property
    def corners(self) -> Array:
        """Points (k, 3) that carry forces, in the contact frame: 1, or 4 counter-clockwise."""
        if self.half_size is None:
            return np.zeros((1, 3))
        x, y = self.half_size
        return np.array([[x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0]])

    def center(self, position: Array, rotation: Array) -> Array:
        """Origin (3,) of the contact frame for a contact, in the frame of the contact, metres.

        The centre of a ball lies one radius from the contact point, along the surface's normal.

        Args:
            position: (3,) contact point, or middle of the patch, metres.
            rotation: (3, 3) contact frame, whose third column is the surface's outward normal.
        """
        return np.asarray(position + self.radius * rotation[:, 2])

    def target(self, base: pin.SE3, position: Array, rotation: Array) -> tuple[Array, Array | None]:
        """Pose of the contact frame in the limb's base frame that realises a contact.

        The input of inverse kinematics (`projection.project`).

        Args:
            base: placement of the limb's base joint in the planning frame.
            position: (3,) contact point, or middle of the patch, in the planning frame, metres.
            rotation: (3, 3) contact frame in the planning frame, columns t1, t2, n.

        Returns:
            Position (3,) in metres, and rotation (3, 3), None for a ball, whose rotation is free.
        """
        turned = base.rotation.T @ rotation if self.planar else None
        return base.actInv(self.center(position, rotation)), turned

    def faces(self, joints: Array, normal: Array) -> bool:
        """True where the part of the ball that makes contact is on a surface's side.

        Args:
            joints: (n,) of the limb. normal: (3,) of the surface in the base frame.
        """
        if self.facing <= -1.0:
            return True
        rotation = self.kinematics.placement_and_jacobian(joints)[1]
        return bool(rotation[:, 2] @ normal >= self.facing)

    @property
    def last_joint(self) -> int:
        """Id of the joint that carries the effector."""
        return int(self.joints[-1])


def make_limb(
    model: pin.Model, text: LimbDescription, low: Array, high: Array, reference: Array
) -> Limb:
    """Resolve a limb's names in a model.

    Args:
        low, high: (nq,) limits of the whole configuration. reference: (nq,) the reference posture.

    Raises:
        InvalidInput: unknown joint or frame, or joints the planner cannot use.
    """
    field = f"limbs.{text.name}"
    if not model.existJointName(text.first_joint):
        known = ", ".join(model.names[2:])
        raise InvalidInput(f"{field}.first_joint", text.first_joint, f"unknown; known: {known}")
    if not model.existFrame(text.effector):
        known = ", ".join(f.name for f in model.frames if f.type == pin.FrameType.BODY)
        raise InvalidInput(f"{field}.effector", text.effector, f"unknown frame; links: {known}")
    frame = model.getFrameId(text.effector)
    joints = _joints_between(model, model.getJointId(text.first_joint), frame)
    base, contact = model.parents[joints[0]], _contact_frame(text)
    q_index = np.array([model.joints[j].idx_q for j in joints])
    return Limb(
        name=text.name,
        effector=text.effector,
        base=base,
        joints=np.array(joints),
        q_index=q_index,
        low=low[q_index],
        high=high[q_index],
        frame=frame,
        contact=contact,
        radius=text.contact.radius if isinstance(text.contact, PointContact) else 0.0,
        half_size=(
            None if isinstance(text.contact, PointContact) else np.array(text.contact.half_size)
        ),
        facing=(
            float(np.cos(text.contact.angle)) if isinstance(text.contact, PointContact) else -1.0
        ),
        kinematics=LimbKinematics(model, reference, base, np.array(joints), frame, contact),
        surfaces=text.surfaces,
        root_pitch=text.root_pitch,
        heuristics=dict(text.heuristics),
        samples=text.samples,
    )


def _contact_frame(text: LimbDescription) -> pin.SE3:
    field = f"limbs.{text.name}.contact"
    if isinstance(text.contact, PointContact):
        axis = np.array(text.contact.axis)
        if not axis.any():
            raise InvalidInput(f"{field}.axis", text.contact.axis, "has no direction")
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), -axis).matrix()
        return pin.SE3(turn, np.array(text.contact.center))
    return Placement.parse(text.contact.position, text.contact.orientation, field).transform


def _joints_between(model: pin.Model, first: int, frame: int) -> list[int]:
    """Ids of the joints from the first one to the one that carries a frame."""
    joints = [model.frames[frame].parentJoint]
    while joints[0] != first:
        if joints[0] == 0:
            reason = f"does not hang on the limb's first joint {model.names[first]}"
            raise InvalidInput("limbs.effector", model.frames[frame].name, reason)
        joints.insert(0, model.parents[joints[0]])
    for joint in joints:
        if model.joints[joint].nq != 1:
            reason = f"joint type {model.joints[joint].shortname()} is not supported in a limb"
            raise InvalidInput("joint", model.names[joint], f"{reason}: one bounded axis is")
    return joints
