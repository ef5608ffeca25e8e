"""What there is to show of a plan: robot links, their placements, environment, footprints.

Metres, planning frame, z up. Needs the plan and the files that it names, nothing of the planner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import trimesh
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan, StateEntry
from rbprm_core.resources import find_resource
from rbprm_core.view.ground import read_ground
from rbprm_core.view.links import Link, read_links
from rbprm_core.view.meshes import frame_on

Array = NDArray[np.float64]

SAME_FOOTPRINT = 1.5e-3  # metres; the plan format lets a kept contact drift by as much


@dataclass(frozen=True, eq=False)
class Footprint:
    """A contact at the state that makes it.

    Attributes:
        limb: name of the limb.
        state: index of the first state that has the contact.
        position: (3,) contact point, metres.
        normal: (3,) unit outward normal of the surface.
        corners: (k, 3) corners of the patch in order around it; empty for a point contact.
    """

    limb: str
    state: int
    position: Array
    normal: Array
    corners: Array

    @property
    def radius(self) -> float:
        """Metres from the contact point to the farthest corner; 0 for a point contact."""
        return float(np.linalg.norm(self.corners - self.position, axis=1).max(initial=0))


@dataclass(frozen=True, eq=False)
class PlanScene:
    """A plan made ready to be drawn.

    Attributes:
        model: kinematics, free-flyer first.
        links: geometry, one entry for each joint that carries some.
        configurations: (n, nq) one row per state, in pinocchio's order.
        limbs: names in the order in which they first make contact.
        footprints: ordered by state.
        environment: triangles of all meshes and surfaces.
        guide: (m, 3) root positions along the guide path, metres.
    """

    model: pin.Model
    links: tuple[Link, ...]
    configurations: Array
    limbs: tuple[str, ...]
    footprints: tuple[Footprint, ...]
    environment: trimesh.Trimesh
    guide: Array

    @property
    def roots(self) -> Array:
        """(n, 3) root positions of the states, metres."""
        return self.configurations[:, :3]

    def placements(self, configurations: Array) -> Array:
        """(n, links, 4, 4) transforms of the links into the planning frame.

        Args:
            configurations: (n, nq) rows as in `self.configurations`.
        """
        data = self.model.createData()
        result = np.empty((len(configurations), len(self.links), 4, 4))
        for row, q in zip(result, configurations, strict=True):
            pin.forwardKinematics(self.model, data, q)
            for slot, link in zip(row, self.links, strict=True):
                slot[:] = data.oMi[link.joint].homogeneous
        return result

    def between(self, steps: int) -> Array:
        """((n - 1) * steps + 1, nq): the states, and `steps - 1` interpolations between each pair.

        Joints go linearly, the root along the shortest screw motion. Row i * steps is state i.
        """
        rows = [
            pin.interpolate(self.model, before, after, k / steps)
            for before, after in zip(self.configurations, self.configurations[1:], strict=False)
            for k in range(steps)
        ]
        return np.array([*rows, self.configurations[-1]])


def make_scene(plan: ContactPlan) -> PlanScene:
    """Read the robot and the environment of a plan.

    Raises:
        InvalidInput: no states; a file is missing or unreadable; joints, contact frames or
            surfaces do not fit; names the field of the plan.
    """
    if not plan.states:
        raise InvalidInput("states", (), "the plan has no states, there is nothing to show")
    urdf = str(find_resource(plan.robot.urdf, "robot.urdf"))
    try:
        model = pin.buildModelFromUrdf(urdf, pin.JointModelFreeFlyer())
    except (RuntimeError, ValueError) as error:
        raise InvalidInput("robot.urdf", plan.robot.urdf, f"cannot be read: {error}") from error
    tips = _contact_joints(model, plan)
    return PlanScene(
        model=model,
        links=read_links(model, urdf, tips),
        configurations=configurations(model, plan),
        limbs=tuple(dict.fromkeys(c.limb for s in plan.states for c in s.contacts)),
        footprints=footprints(plan.states),
        environment=read_ground(plan.environment),
        guide=np.array([pose.position for pose in plan.guide]).reshape(-1, 3),
    )


def _contact_joints(model: pin.Model, plan: ContactPlan) -> dict[int, str]:
    """Joint that carries each contact frame, and the limb's name."""
    joints: dict[int, str] = {}
    for i, state in enumerate(plan.states):
        for k, contact in enumerate(state.contacts):
            if not model.existFrame(contact.frame):
                reason = f"unknown frame of {plan.robot.urdf}"
                raise InvalidInput(f"states.{i}.contacts.{k}.frame", contact.frame, reason)
            joints[model.frames[model.getFrameId(contact.frame)].parentJoint] = contact.limb
    return joints


def configurations(model: pin.Model, plan: ContactPlan) -> Array:
    """States in pinocchio's order; the plan names its own order of the joints."""
    names = plan.robot.joint_names
    if sorted(names) != sorted(model.names[2:]):
        known = ", ".join(model.names[2:])
        raise InvalidInput("robot.joint_names", names, f"must be the joints of the URDF: {known}")
    joints = [model.joints[model.getJointId(name)] for name in names]
    for name, joint in zip(names, joints, strict=True):
        if joint.nq != 1:
            reason = (
                f"joint {name} takes {joint.nq} numbers; only joints of one number can be shown"
            )
            raise InvalidInput("robot.joint_names", names, reason)
    result = np.empty((len(plan.states), model.nq))
    for i, (row, state) in enumerate(zip(result, plan.states, strict=True)):
        if len(state.joints) != len(names):
            reason = (
                f"must have {len(names)} numbers, as robot.joint_names, has {len(state.joints)}"
            )
            raise InvalidInput(f"states.{i}.joints", state.joints, reason)
        row[:3], row[3:7] = state.root.position, _unit(state.root.orientation, i)
        row[[joint.idx_q for joint in joints]] = state.joints
    return result


def _unit(quaternion: tuple[float, ...], state: int) -> Array:
    array = np.array(quaternion)
    norm = float(np.linalg.norm(array))
    if abs(norm - 1) > 1e-2:
        reason = f"must be a unit quaternion [x, y, z, w], its norm is {norm:g}"
        raise InvalidInput(f"states.{state}.root.orientation", quaternion, reason)
    return array / norm


def footprints(states: tuple[StateEntry, ...]) -> tuple[Footprint, ...]:
    """Each contact once, at the state that makes or moves it."""
    found: list[Footprint] = []
    held: dict[str, Footprint] = {}
    for index, state in enumerate(states):
        now: dict[str, Footprint] = {}
        for contact in state.contacts:
            position = np.array(contact.position)
            old = held.get(contact.limb)
            if old is None or np.linalg.norm(old.position - position) > SAME_FOOTPRINT:
                normal = np.array(contact.normal) / np.linalg.norm(contact.normal)
                corners = _around(np.array(contact.points).reshape(-1, 3), normal)
                old = Footprint(contact.limb, index, position, normal, corners)
                found.append(old)
            now[contact.limb] = old
        held = now
    return tuple(found)


def _around(points: Array, normal: Array) -> Array:
    """Corners counter-clockwise about the normal; empty if they are too few for a patch."""
    if len(points) < 3:
        return np.empty((0, 3))
    flat = trimesh.transform_points(points, np.linalg.inv(frame_on(points[0], normal)))
    x, y = (flat - flat.mean(axis=0))[:, :2].T
    return points[np.argsort(np.arctan2(y, x))]
