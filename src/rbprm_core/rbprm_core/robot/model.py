"""The robot: pinocchio model, limits, limbs and collision geometry, from its description."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, IntArray
from rbprm_core.errors import InvalidInput
from rbprm_core.resources import find_resource, share_folders
from rbprm_core.robot.description import RobotDescription
from rbprm_core.robot.limb import Limb, make_limb

ROOT_JOINT = 1  # pinocchio numbers the universe 0 and the free-flyer 1


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot with a floating base, called root.

    A configuration q (nq,) is that of pinocchio: position of the root (3) in metres, unit
    quaternion [x, y, z, w] of the root (4), positions of the joints in radians or metres.

    Attributes:
        description: the robot's description.
        model: pinocchio's kinematic model with masses, the root as a free-flyer joint.
        limbs: the limbs, in the order of the description.
        low: (nq,) lower limits of the configuration; minus infinity for the root.
        high: (nq,) upper limits of the configuration; infinity for the root.
        reference: (nq,) reference posture with the root at the origin.
        joint_names: names of the joints in the order of the configuration, without the root.
        root_joints: ids of the joints planned with the root.
        root_index: (7 + j,) indices in q of the degrees of freedom planned with the root: the
            root's pose, then the j joints.
    """

    description: RobotDescription
    model: pin.Model
    limbs: tuple[Limb, ...]
    low: Array
    high: Array
    reference: Array
    joint_names: tuple[str, ...]
    root_joints: tuple[int, ...]
    root_index: IntArray

    @cached_property
    def geometry(self) -> pin.GeometryModel:
        """Collision geometry of the URDF, with the pairs that the SRDF does not disable.

        It is read at first use: meshes take a hundred times as long as the rest of the robot.

        Raises:
            InvalidInput: meshes, or pairs in the SRDF, that cannot be read.
        """
        return _read_geometry(self.model, self.description)

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.description.name

    @property
    def mass(self) -> float:
        """Total mass, kilograms."""
        return float(pin.computeTotalMass(self.model))

    @cached_property
    def reference_height(self) -> float:
        """Height of the root over its lowest contact in the reference posture, metres."""
        data = self.model.createData()
        pin.framesForwardKinematics(self.model, data, self.reference)
        contacts = ((data.oMf[limb.frame].act(limb.contact), limb.radius) for limb in self.limbs)
        return float(max(radius - contact.translation[2] for contact, radius in contacts))

    def fixed_to(self, joint: int) -> int:
        """Id of the nearest moving joint among a joint and its ancestors.

        The root, the joints planned with it and the joints of limbs move; all other joints keep
        their position in the reference posture.

        Args:
            joint: id of a joint.
        """
        moving = {ROOT_JOINT, *self.root_joints, *(j for limb in self.limbs for j in limb.joints)}
        while joint not in moving:
            joint = self.model.parents[joint]
        return joint

    @staticmethod
    def load(description: RobotDescription) -> Robot:
        """The robot of a description, read from its URDF and SRDF without the meshes.

        The limbs are the description's default ones; `RobotDescription.using` chooses others.

        Args:
            description: description of the robot.

        Raises:
            InvalidInput: a missing or unreadable file, an unknown name, or an unsupported joint.
        """
        if description.default_limbs is not None:
            description = description.using()
        model = _read_model(description)
        low, high = _limits(model, description)
        reference = _reference(model, description, low, high)
        limbs = tuple(make_limb(model, limb, low, high, reference) for limb in description.limbs)
        root_joints = _root_joints(model, description, limbs)
        root_index = [*range(7), *(model.joints[j].idx_q for j in root_joints)]
        return Robot(
            description=description,
            model=model,
            limbs=limbs,
            low=low,
            high=high,
            reference=reference,
            joint_names=tuple(model.names[2:]),
            root_joints=tuple(root_joints),
            root_index=np.array(root_index),
        )


def _root_joints(
    model: pin.Model, description: RobotDescription, limbs: tuple[Limb, ...]
) -> list[int]:
    """Ids of the joints planned with the root, none of which belongs to a limb."""
    taken = _taken_joints(model, limbs)
    root_joints = [_joint(model, name, "robot.root_joints") for name in description.root_joints]
    for joint in root_joints:
        if root_joints.count(joint) > 1:
            raise InvalidInput("robot.root_joints", model.names[joint], "is named twice")
        if joint in taken:
            reason = f"is a joint of limb {taken[joint]}; it cannot be planned with the root too"
            raise InvalidInput("robot.root_joints", model.names[joint], reason)
    return root_joints


def _taken_joints(model: pin.Model, limbs: tuple[Limb, ...]) -> dict[int, str]:
    """Name of the limb by id of joint, for the joints of all limbs."""
    taken: dict[int, str] = {}
    for limb in limbs:
        for joint in map(int, limb.joints):
            if joint in taken:
                reason = f"shares {model.names[joint]} with limb {taken[joint]}: choose one of them"
                raise InvalidInput("limbs", limb.name, reason)
            taken[joint] = limb.name
    return taken


def _joint(model: pin.Model, name: str, field: str) -> int:
    """Id of a joint with one axis, which the root's joint is not."""
    if name not in model.names[2:]:
        known = ", ".join(model.names[2:])
        raise InvalidInput(field, name, f"unknown joint; known: {known}")
    joint = int(model.getJointId(name))
    if model.joints[joint].nq != 1:
        reason = (
            f"joint type {model.joints[joint].shortname()} is not supported; it must have one axis"
        )
        raise InvalidInput(field, name, reason)
    return joint


def _read_model(description: RobotDescription) -> pin.Model:
    path = find_resource(description.urdf, "robot.urdf")
    try:
        model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    except (RuntimeError, ValueError) as error:
        raise InvalidInput("robot.urdf", description.urdf, f"cannot be read: {error}") from error
    if description.srdf is not None:
        srdf = str(find_resource(description.srdf, "robot.srdf"))
        try:
            pin.loadReferenceConfigurations(model, srdf)
        except (RuntimeError, ValueError) as error:
            raise _bad_srdf(description.srdf, error) from error
    return model


def _bad_srdf(srdf: str, error: Exception) -> InvalidInput:
    return InvalidInput("robot.srdf", srdf, f"cannot be read: {error}")


def _limits(model: pin.Model, description: RobotDescription) -> tuple[Array, Array]:
    """Joint limits of the URDF, narrowed by the description's ranges."""
    low, high = model.lowerPositionLimit.copy(), model.upperPositionLimit.copy()
    low[:7], high[:7] = -np.inf, np.inf
    for name, (lower, upper) in description.joint_ranges.items():
        index = model.joints[_joint(model, name, "robot.joint_ranges")].idx_q
        low[index], high[index] = max(low[index], lower), min(high[index], upper)
        if low[index] > high[index]:
            reason = "lies outside the URDF's limits"
            raise InvalidInput(f"robot.joint_ranges.{name}", (lower, upper), reason)
    return low, high


def _read_geometry(model: pin.Model, description: RobotDescription) -> pin.GeometryModel:
    """Collision geometry with the pairs that the SRDF does not disable."""
    shares = share_folders()
    folders = [str(f) for share in shares for f in (share, share / "example-robot-data" / "robots")]
    urdf = str(find_resource(description.urdf, "robot.urdf"))
    try:
        geometry = pin.buildGeomFromUrdf(
            model, urdf, pin.GeometryType.COLLISION, package_dirs=folders
        )
    except (RuntimeError, ValueError) as error:
        reason = f"its collision meshes cannot be read: {error}"
        raise InvalidInput("robot.urdf", description.urdf, reason) from error
    geometry.addAllCollisionPairs()
    if description.srdf is not None:
        srdf = str(find_resource(description.srdf, "robot.srdf"))
        try:
            pin.removeCollisionPairs(model, geometry, srdf)
        except (RuntimeError, ValueError) as error:
            raise _bad_srdf(description.srdf, error) from error
    else:
        _remove_adjacent_pairs(model, geometry)
    return geometry


def _remove_adjacent_pairs(model: pin.Model, geometry: pin.GeometryModel) -> None:
    """Remove the pairs of links that share a joint, since without an SRDF these may touch."""
    joints = [g.parentJoint for g in geometry.geometryObjects]
    for pair in list(geometry.collisionPairs):
        a, b = joints[pair.first], joints[pair.second]
        if a == b or model.parents[a] == b or model.parents[b] == a:
            geometry.removeCollisionPair(pair)


def _reference(model: pin.Model, description: RobotDescription, low: Array, high: Array) -> Array:
    """Reference posture (nq,) with the root at the origin, inside the limits."""
    q = pin.neutral(model)
    posture = description.reference_posture
    if isinstance(posture, str):
        known = [entry.key() for entry in model.referenceConfigurations]
        if posture not in known:
            reason = f"no such group state in the SRDF; known: {', '.join(known) or 'none'}"
            raise InvalidInput("robot.reference_posture", posture, reason)
        q[7:] = model.referenceConfigurations[posture][7:]
    else:
        for name, value in posture.items():
            q[model.joints[_joint(model, name, "robot.reference_posture")].idx_q] = value
    return np.asarray(np.clip(q, low, high))
