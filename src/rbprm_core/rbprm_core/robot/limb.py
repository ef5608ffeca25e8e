"""A limb: the joints from its base to an effector that makes contact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, IntArray
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.contact_spot import ContactSpot, make_spot
from rbprm_core.robot.description import LimbDescription
from rbprm_core.robot.kinematics import LimbKinematics
from rbprm_core.surface_kind import SurfaceKind


@dataclass(frozen=True, eq=False)
class Limb:
    """One limb R^k of the robot (Tonneau et al. 2018, section 2.3).

    Attributes:
        name: name of the limb.
        base: id of the joint that the limb is attached to; workspaces and samples are in its frame.
        joints: (n,) ids of the limb's joints, from the base outwards.
        q_index: (n,) indices of the joints in the robot's configuration.
        low: (n,) lower joint limits, radians or metres.
        high: (n,) upper joint limits, radians or metres.
        spots: the parts of the limb that can make contact; today exactly one.
        kinematics: kinematics of the contact frame in the base frame, on the limb's joints alone.
        surfaces: kinds of surface that the limb may be in contact with.
        root_pitch: smallest and largest pitch of the root that samples are made for, radians.
        heuristics: weight by name of heuristic; their weighted sum ranks contact candidates.
        samples: number of samples in the limb's database.
    """

    name: str
    base: int
    joints: IntArray
    q_index: IntArray
    low: Array
    high: Array
    spots: tuple[ContactSpot, ...]
    kinematics: LimbKinematics
    surfaces: tuple[SurfaceKind, ...]
    root_pitch: tuple[float, float]
    heuristics: dict[str, float]
    samples: int

    @cached_property
    def spot(self) -> ContactSpot:
        """The contact spot that the limb makes contact with."""
        return self.spots[0]

    @cached_property
    def effector(self) -> str:
        """Name of the frame in the URDF that the contact spot is fixed to."""
        return self.spot.frame_name

    @cached_property
    def frame(self) -> int:
        """Id of the frame in the model that the contact spot is fixed to."""
        return self.spot.frame

    @cached_property
    def contact(self) -> pin.SE3:
        """Placement of the contact frame in the effector frame."""
        return self.spot.placement

    @cached_property
    def radius(self) -> float:
        """Radius of the contact spot's ball, metres; 0 for a rectangle."""
        return self.spot.radius

    @cached_property
    def half_size(self) -> Array | None:
        """Half the sides (2,) of the contact spot's rectangle, metres; None for a ball."""
        return self.spot.half_size

    @cached_property
    def min_cosine(self) -> float:
        """Smallest cosine between the contact frame's z axis and a surface's normal."""
        return self.spot.min_cosine

    @cached_property
    def planar(self) -> bool:
        """True where the limb makes planar contacts."""
        return self.spot.planar

    @cached_property
    def corners(self) -> Array:
        """Points (k, 3) that carry forces, in the contact frame, metres."""
        return self.spot.corners

    @cached_property
    def last_joint(self) -> int:
        """Id of the joint that the effector is fixed to."""
        return int(self.joints[-1])

    def target(self, base: pin.SE3, position: Array, rotation: Array) -> tuple[Array, Array | None]:
        """Pose of the contact frame in the limb's base frame that realises a contact.

        It is what inverse kinematics solves for (`projection.project`).

        Args:
            base: placement of the limb's base joint in the planning frame.
            position: (3,) contact point, or middle of the rectangle, in the planning frame, metres.
            rotation: (3, 3) frame of the contact in the planning frame, columns t1, t2 and n.

        Returns:
            Position (3,) in metres, and rotation (3, 3), None for a ball, whose rotation is free.
        """
        turned = base.rotation.T @ rotation if self.planar else None
        return base.actInv(self.spot.center(position, rotation)), turned

    def faces(self, joints: Array, normal: Array) -> bool:
        """True where the part of the ball that makes contact faces a surface.

        Args:
            joints: (n,) joint positions of the limb.
            normal: (3,) outward unit normal of the surface in the base frame.
        """
        if self.min_cosine <= -1.0:
            return True
        rotation = self.kinematics.placement_and_jacobian(joints)[1]
        return bool(rotation[:, 2] @ normal >= self.min_cosine)


def make_limb(
    model: pin.Model, description: LimbDescription, low: Array, high: Array, reference: Array
) -> Limb:
    """A limb from its description, with all names looked up in the robot's model.

    Args:
        model: kinematic model of the robot.
        description: the limb's description.
        low: (nq,) lower limits of the configuration.
        high: (nq,) upper limits of the configuration.
        reference: (nq,) reference posture.

    Raises:
        InvalidInput: an unknown joint or frame, or joints that the planner does not support.
    """
    if not model.existJointName(description.first_joint):
        known = ", ".join(model.names[2:])
        field = f"limbs.{description.name}.first_joint"
        raise InvalidInput(field, description.first_joint, f"unknown; known: {known}")
    spot = make_spot(model, description)
    joints = _joints_between(model, model.getJointId(description.first_joint), spot.frame)
    base = model.parents[joints[0]]
    ids, q_index = np.array(joints), np.array([model.joints[j].idx_q for j in joints])
    return Limb(
        name=description.name,
        base=base,
        joints=ids,
        q_index=q_index,
        low=low[q_index],
        high=high[q_index],
        spots=(spot,),
        kinematics=LimbKinematics(model, reference, base, ids, spot.frame, spot.placement),
        surfaces=description.surfaces,
        root_pitch=description.root_pitch,
        heuristics=dict(description.heuristics),
        samples=description.samples,
    )


def _joints_between(model: pin.Model, first: int, frame: int) -> list[int]:
    """Ids of the joints from the first one to the one that a frame is fixed to."""
    joints = [model.frames[frame].parentJoint]
    while joints[0] != first:
        if joints[0] == 0:
            reason = f"is not attached to the limb's first joint {model.names[first]}"
            raise InvalidInput("limbs.effector", model.frames[frame].name, reason)
        joints.insert(0, model.parents[joints[0]])
    for joint in joints:
        if model.joints[joint].nq != 1:
            reason = f"joint type {model.joints[joint].shortname()} is not supported in a limb"
            raise InvalidInput(
                "joint", model.names[joint], f"{reason}; it must have one bounded axis"
            )
    return joints
