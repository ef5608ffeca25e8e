"""The robot of a plan, read from its URDF by pinocchio alone."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.check.poses import pose_transform
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import RobotEntry, StateEntry
from rbprm_core.resources import find_resource, share_folders

FIRST_JOINT = 2  # index of the first joint after "universe" and the floating base


class Robot:
    """A floating-base robot and its unsimplified collision geometry, at one state at a time.

    Args:
        entry: robot of the plan.

    Attributes:
        urdf: path of the URDF.
        model: pinocchio model with a floating base.
        data: pinocchio data of the model, computed by `place`.
        geometry: collision geometry of the links, with the pairs to check for self-collision.
        geometry_data: pinocchio data of the geometry, computed by `place`.
        joint_names: names of the joints in the order of the plan.

    Raises:
        InvalidInput: the URDF, the SRDF or a mesh is missing or malformed, a joint has more than
            one coordinate, or the joint names are not those of the URDF.
    """

    def __init__(self, entry: RobotEntry) -> None:
        self.urdf = find_resource(entry.urdf, "robot.urdf")
        self.model, self.geometry = _load(self.urdf)
        self.data = self.model.createData()
        self.joint_names = entry.joint_names
        self._indices = [self._coordinate(name) for name in entry.joint_names]
        self._require_all_joints()
        _select_pairs(self.model, self.geometry, entry.srdf)
        self.geometry_data = self.geometry.createData()
        for request in self.geometry_data.collisionRequests:
            request.enable_contact = True  # without it coal misses some pairs of convex hulls

    @property
    def mass(self) -> float:
        """Total mass of the robot, kilograms."""
        return float(pin.computeTotalMass(self.model))

    def place(self, state: StateEntry, index: int) -> None:
        """Compute frames, centre of mass and placements of the geometry at a state.

        Args:
            state: state of the plan.
            index: its index.

        Raises:
            InvalidInput: there is not one joint value for each joint name, or the root pose is not
                a pose.
        """
        field = f"states.{index}"
        if len(state.joints) != len(self._indices):
            reason = f"must have {len(self._indices)} values, one for each of robot.joint_names"
            raise InvalidInput(f"{field}.joints", state.joints, reason)
        q = pin.neutral(self.model)
        q[:7] = pin.SE3ToXYZQUAT(pose_transform(state.root, f"{field}.root"))
        q[self._indices] = state.joints
        pin.framesForwardKinematics(self.model, self.data, q)
        pin.centerOfMass(self.model, self.data, q)
        pin.updateGeometryPlacements(self.model, self.data, self.geometry, self.geometry_data)

    @property
    def com(self) -> Array:
        """Centre of mass (3,) at the last placed state, metres, planning frame."""
        return np.array(self.data.com[0])

    def frame(self, name: str, field: str) -> int:
        """Return the index of a frame; the frame of the link if a link and a joint share the name.

        Args:
            name: name of the frame.
            field: name of the field in errors.

        Raises:
            InvalidInput: the URDF has no such frame, or it is fixed to the world.
        """
        if not self.model.existFrame(name):
            raise InvalidInput(field, name, f"is not a frame of {self.urdf}")
        is_link = self.model.existFrame(name, pin.BODY)
        index = self.model.getFrameId(name, pin.BODY) if is_link else self.model.getFrameId(name)
        if self.model.frames[index].parentJoint == 0:
            raise InvalidInput(field, name, "is a frame of the world and not of the robot")
        return int(index)

    def contact_link(self, frame: int) -> int:
        """Return the frame index of the link that touches the environment at a contact frame.

        It is the link of the contact frame. For a link without collision geometry, such as the sole
        frame of a humanoid, it is the link to which that one is fixed.

        Args:
            frame: index of the contact frame.
        """
        frames = self.model.frames
        if frames[frame].type != pin.BODY:
            frame = next(
                (i for i, f in enumerate(frames) if f.type == pin.BODY and f.parentFrame == frame),
                frame,
            )
        shaped = {geometry.parentFrame for geometry in self.geometry.geometryObjects}
        link = frame
        while link not in shaped:
            joint = frames[link].parentFrame
            if frames[joint].type != pin.FIXED_JOINT:
                return frame
            link = frames[joint].parentFrame
        return int(link)

    def _coordinate(self, name: str) -> int:
        """Return the index in q of a joint with a single coordinate."""
        if not self.model.existJointName(name) or self.model.getJointId(name) < FIRST_JOINT:
            known = ", ".join(self.model.names[FIRST_JOINT:])
            raise InvalidInput("robot.joint_names", name, f"unknown; the URDF has {known}")
        joint = self.model.joints[self.model.getJointId(name)]
        if joint.nq != 1:
            reason = f"has {joint.nq} coordinates; only joints with one coordinate are supported"
            raise InvalidInput("robot.joint_names", name, reason)
        return int(joint.idx_q)

    def _require_all_joints(self) -> None:
        """Raise `InvalidInput` unless each movable joint of the URDF is named exactly once."""
        named = self.joint_names
        missing = set(self.model.names[FIRST_JOINT:]) - set(named)
        if missing or len(set(named)) != len(named):
            reason = "must name each movable joint of the URDF once"
            reason += f"; missing are {', '.join(sorted(missing))}" if missing else ""
            raise InvalidInput("robot.joint_names", named, reason)


def _load(urdf: Path) -> tuple[Any, Any]:
    """Return the model with a floating base, and its collision geometry with all pairs of links."""
    _refuse_mimic_joints(urdf)
    folders = [str(folder) for share in share_folders() for folder in _package_folders(share)]
    try:
        model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
        kind = pin.GeometryType.COLLISION
        geometry = pin.buildGeomFromUrdf(model, str(urdf), kind, package_dirs=folders)
    except (ValueError, RuntimeError) as error:
        raise InvalidInput("robot.urdf", str(urdf), f"cannot be loaded: {error}") from error
    geometry.addAllCollisionPairs()
    return model, geometry


def _package_folders(share: Path) -> tuple[Path, Path]:
    """Return the folders that `package://` addresses of a `share` folder start from."""
    return share, share / "example-robot-data" / "robots"


def _refuse_mimic_joints(urdf: Path) -> None:
    """Raise `InvalidInput` if a movable joint mimics another one: it is not a free coordinate."""
    try:
        joints = ElementTree.parse(urdf).getroot().findall("joint")
    except ElementTree.ParseError as error:
        raise InvalidInput("robot.urdf", str(urdf), f"is not XML: {error}") from error
    for joint in joints:
        if joint.find("mimic") is not None and joint.get("type") != "fixed":
            reason = f"has an unsupported mimic joint, {joint.get('name')}; make it fixed"
            raise InvalidInput("robot.urdf", str(urdf), reason)


def _select_pairs(model: Any, geometry: Any, srdf: str | None) -> None:
    """Remove the pairs that the SRDF disables; without an SRDF, those of neighbouring joints."""
    if srdf is not None:
        path = find_resource(srdf, "robot.srdf")
        try:
            pin.removeCollisionPairs(model, geometry, str(path), False)
        except (ValueError, RuntimeError) as error:
            raise InvalidInput("robot.srdf", srdf, f"cannot be loaded: {error}") from error
        return
    for pair in list(geometry.collisionPairs):
        first, second = (geometry.geometryObjects[k].parentJoint for k in (pair.first, pair.second))
        if model.parents[first] == second or model.parents[second] == first:
            geometry.removeCollisionPair(pair)
