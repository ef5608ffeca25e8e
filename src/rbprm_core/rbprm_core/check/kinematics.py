"""The robot of a plan, from its URDF by pinocchio alone: limits, contact poses, centre of mass."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.check.poses import pose_transform, transform, unit
from rbprm_core.check.report import PLAN, Kind, Violation
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactEntry, RobotEntry, StateEntry
from rbprm_core.resources import find_resource, share_folders

LIMIT_SLACK = 1e-6  # rad or m: a joint at its limit may have been rounded on its way to the file
POSITION_BOUND = 1.5e-3
ANGLE_BOUND = np.deg2rad(0.6)
COM_BOUND = 1e-3
POINT_BOUND = 1e-4  # a point contact's point is its position, given twice
FIRST_JOINT = 2  # "universe" and the floating base come first


class Robot:
    """A floating-base robot and its raw collision geometry, placed at one configuration at a time.

    Raises:
        InvalidInput: a missing or malformed URDF, SRDF or mesh; a joint that a single number does
            not describe; joint names that are not those of the URDF.
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
        """Total mass, kilograms."""
        return float(pin.computeTotalMass(self.model))

    def place(self, state: StateEntry, index: int) -> None:
        """Compute frames, centre of mass and geometry placements of a state.

        Raises:
            InvalidInput: a number of joint values other than that of the joint names; no root pose.
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
    def com(self) -> NDArray[np.float64]:
        """Centre of mass (3,) at the placed state, planning frame, metres."""
        return np.array(self.data.com[0])

    def frame(self, name: str, field: str) -> int:
        """Index of a frame; a link's where a link and a joint share the name.

        Raises:
            InvalidInput: the URDF has no such frame, or it is the world's.
        """
        if not self.model.existFrame(name):
            raise InvalidInput(field, name, f"is no frame of {self.urdf}")
        is_link = self.model.existFrame(name, pin.BODY)
        index = self.model.getFrameId(name, pin.BODY) if is_link else self.model.getFrameId(name)
        if self.model.frames[index].parentJoint == 0:
            raise InvalidInput(field, name, "is a frame of the world, not of the robot")
        return int(index)

    def standing_link(self, frame: int) -> int:
        """Frame index of the link that stands on a contact of `frame`.

        It is the frame's link. A link without collision geometry, such as the sole frame of a
        humanoid, stands through the link that it is fixed to.
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
        """Index in q of a joint with a single coordinate."""
        if not self.model.existJointName(name) or self.model.getJointId(name) < FIRST_JOINT:
            known = ", ".join(self.model.names[FIRST_JOINT:])
            raise InvalidInput("robot.joint_names", name, f"unknown; the URDF has {known}")
        joint = self.model.joints[self.model.getJointId(name)]
        if joint.nq != 1:
            reason = f"has {joint.nq} coordinates; only joints with limits and one axis are known"
            raise InvalidInput("robot.joint_names", name, reason)
        return int(joint.idx_q)

    def _require_all_joints(self) -> None:
        named = self.joint_names
        missing = set(self.model.names[FIRST_JOINT:]) - set(named)
        if missing or len(set(named)) != len(named):
            reason = "must name each movable joint of the URDF once"
            reason += f"; missing are {', '.join(sorted(missing))}" if missing else ""
            raise InvalidInput("robot.joint_names", named, reason)


def joint_order(robot: Robot) -> Iterator[Violation]:
    """Joint names in another order than the URDF's."""
    expected = tuple(robot.model.names[FIRST_JOINT:])
    if robot.joint_names != expected:
        text = f"joint names are not in the URDF's order, which is {', '.join(expected)}"
        yield Violation(PLAN, "", Kind.JOINT_ORDER, text)


def joint_limits(robot: Robot, state: StateEntry, index: int) -> Iterator[Violation]:
    """Joints outside the URDF's limits."""
    lower, upper = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
    for name, value in zip(robot.joint_names, state.joints, strict=True):
        k = robot.model.joints[robot.model.getJointId(name)].idx_q
        if not lower[k] - LIMIT_SLACK <= value <= upper[k] + LIMIT_SLACK:
            text = f"joint {name} at {value:.6g} (limits {lower[k]:.6g} to {upper[k]:.6g})"
            yield Violation(index, "", Kind.JOINT_LIMIT, text)


def centre_of_mass(robot: Robot, state: StateEntry, index: int) -> Iterator[Violation]:
    """Declared centre of mass away from the one of the placed robot."""
    error = float(np.linalg.norm(robot.com - state.com))
    if error > COM_BOUND:
        text = f"declared centre of mass {_mm(error)} from the URDF's (at most {_mm(COM_BOUND)})"
        yield Violation(index, "", Kind.COM, text)


def contact_pose(
    robot: Robot, contact: ContactEntry, index: int, field: str
) -> Iterator[Violation]:
    """Declared contact frame away from the one of the placed robot."""
    frame = robot.data.oMf[robot.frame(contact.frame, f"{field}.frame")]
    reached = frame * pose_transform(contact.frame_offset, f"{field}.frame_offset")
    declared = transform(contact.position, contact.orientation, field)
    error = float(np.linalg.norm(reached.translation - declared.translation))
    if error > POSITION_BOUND:
        text = f"contact frame {_mm(error)} from the declared one (at most {_mm(POSITION_BOUND)})"
        yield Violation(index, contact.limb, Kind.CONTACT_POSE, text)
    angle = float(np.linalg.norm(pin.log3(reached.rotation.T @ declared.rotation)))
    if contact.type == "planar" and angle > ANGLE_BOUND:
        text = f"contact frame turned by {_deg(angle)} (at most {_deg(ANGLE_BOUND)})"
        yield Violation(index, contact.limb, Kind.CONTACT_POSE, text)


def contact_points(contact: ContactEntry, index: int) -> Iterator[Violation]:
    """Points that do not belong to the declared contact pose.

    The point of a point contact is its position. The corners of a planar contact lie in the plane
    through the position across the normal, within the bound of the pose, and around the position.
    """
    wanted = 1 if contact.type == "point" else 4
    if len(contact.points) != wanted:
        text = f"{len(contact.points)} points ({wanted} for a {contact.type} contact)"
        yield Violation(index, contact.limb, Kind.CONTACT_POINTS, text)
        return
    offsets = np.array(contact.points) - contact.position
    if contact.type == "point":
        error, bound = float(np.linalg.norm(offsets)), POINT_BOUND
        text = f"contact point {_mm(error)} from the contact's position (at most {_mm(bound)})"
    else:
        error, bound = float(np.abs(offsets @ unit(contact.normal)).max()), POSITION_BOUND
        text = f"corner {_mm(error)} off the plane of the contact (at most {_mm(bound)})"
    if error > bound:
        yield Violation(index, contact.limb, Kind.CONTACT_POINTS, text)
    elif contact.type == "planar" and not _surround(offsets, unit(contact.normal)):
        text = "the four corners do not go round the contact's position"
        yield Violation(index, contact.limb, Kind.CONTACT_POINTS, text)


def _surround(offsets: NDArray[np.float64], normal: NDArray[np.float64]) -> bool:
    """Whether corners (4, 3), in either sense of rotation, go once round the origin."""
    turns = np.cross(offsets, np.roll(offsets, -1, axis=0)) @ normal
    return bool((turns > 0).all() or (turns < 0).all())


def _load(urdf: Path) -> tuple[Any, Any]:
    """Model with a floating base, and collision geometry with every pair of links."""
    _refuse_mimic(urdf)
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
    """Where `package://` addresses of a `share` folder start."""
    return share, share / "example-robot-data" / "robots"


def _refuse_mimic(urdf: Path) -> None:
    """Refuse movable joints that follow another: their values are no free coordinates."""
    try:
        joints = ElementTree.parse(urdf).getroot().findall("joint")
    except ElementTree.ParseError as error:
        raise InvalidInput("robot.urdf", str(urdf), f"is no XML: {error}") from error
    for joint in joints:
        if joint.find("mimic") is not None and joint.get("type") != "fixed":
            reason = (
                f"has a mimic joint, {joint.get('name')}, which plans cannot hold; make it fixed"
            )
            raise InvalidInput("robot.urdf", str(urdf), reason)


def _select_pairs(model: Any, geometry: Any, srdf: str | None) -> None:
    """Leave the pairs to test: all but the SRDF's, without one all but neighbouring joints'."""
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


def _mm(length: float) -> str:
    return f"{1e3 * length:.1f} mm"


def _deg(angle: float) -> str:
    return f"{np.rad2deg(angle):.2f} deg"
