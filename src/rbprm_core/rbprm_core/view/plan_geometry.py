"""The geometry of a plan that is drawn: links and their placements, environment, footprints, guide.

All is in metres in the planning frame, z up, and read from the plan and the files that it names.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import trimesh

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan
from rbprm_core.resources import find_resource
from rbprm_core.view.environment_mesh import load_environment_mesh
from rbprm_core.view.footprints import Footprint, footprints
from rbprm_core.view.link_meshes import LinkMesh, load_link_meshes

QUATERNION_TOLERANCE = 1e-2  # allowed difference of a quaternion's norm from 1


@dataclass(frozen=True, eq=False)
class PlanGeometry:
    """The geometry of a plan.

    Attributes:
        model: pinocchio model of the robot with a floating base.
        links: visual geometry, one mesh for each joint that has some.
        configurations: (n, nq) configuration of each state, in pinocchio's order.
        limbs: names of the limbs, in the order in which they first make contact.
        footprints: footprints, ordered by state.
        environment: all triangles of the environment.
        guide: (m, 3) root positions along the guide path, metres.
    """

    model: pin.Model
    links: tuple[LinkMesh, ...]
    configurations: Array
    limbs: tuple[str, ...]
    footprints: tuple[Footprint, ...]
    environment: trimesh.Trimesh
    guide: Array

    @property
    def roots(self) -> Array:
        """Root positions (n, 3) of the states, metres."""
        return self.configurations[:, :3]

    def placements(self, configurations: Array) -> Array:
        """Return the transforms (n, links, 4, 4) of the links into the planning frame.

        Args:
            configurations: (n, nq) configurations in pinocchio's order.
        """
        data = self.model.createData()
        result = np.empty((len(configurations), len(self.links), 4, 4))
        for row, q in zip(result, configurations, strict=True):
            pin.forwardKinematics(self.model, data, q)
            for slot, link in zip(row, self.links, strict=True):
                slot[:] = data.oMi[link.joint].homogeneous
        return result

    def interpolated(self, steps: int) -> Array:
        """Return ((n - 1) * steps + 1, nq) configurations: the states and points between them.

        Joints are interpolated linearly, the root along the shortest screw motion. Row i * steps is
        state i.

        Args:
            steps: number of steps from one state to the next.
        """
        rows = [
            pin.interpolate(self.model, before, after, k / steps)
            for before, after in zip(self.configurations, self.configurations[1:], strict=False)
            for k in range(steps)
        ]
        return np.array([*rows, self.configurations[-1]])


def load_plan_geometry(plan: ContactPlan) -> PlanGeometry:
    """Return the geometry of a plan, reading its robot and its environment.

    Args:
        plan: plan with at least one state.

    Raises:
        InvalidInput: the plan has no states, a file is missing or unreadable, or joints, contact
            frames or surfaces are wrong. It names the field of the plan.
    """
    if not plan.states:
        raise InvalidInput("states", (), "the plan has no states, so there is nothing to show")
    urdf = str(find_resource(plan.robot.urdf, "robot.urdf"))
    try:
        model = pin.buildModelFromUrdf(urdf, pin.JointModelFreeFlyer())
    except (RuntimeError, ValueError) as error:
        raise InvalidInput("robot.urdf", plan.robot.urdf, f"cannot be read: {error}") from error
    return PlanGeometry(
        model=model,
        links=load_link_meshes(model, urdf, _limbs_by_joint(model, plan)),
        configurations=configurations(model, plan),
        limbs=tuple(dict.fromkeys(c.limb for s in plan.states for c in s.contacts)),
        footprints=footprints(plan.states),
        environment=load_environment_mesh(plan.environment),
        guide=np.array([pose.position for pose in plan.guide]).reshape(-1, 3),
    )


def configurations(model: pin.Model, plan: ContactPlan) -> Array:
    """Return the configurations (n, nq) of the states in pinocchio's order of the joints.

    Args:
        model: model of the plan's robot with a floating base.
        plan: plan, which names the joints in its own order.

    Raises:
        InvalidInput: joint names, joint values or root quaternions do not fit.
    """
    coordinates = _joint_coordinates(model, plan.robot.joint_names)
    result = np.empty((len(plan.states), model.nq))
    for i, (row, state) in enumerate(zip(result, plan.states, strict=True)):
        if len(state.joints) != len(coordinates):
            reason = f"must have {len(coordinates)} numbers, one for each of robot.joint_names,"
            reason += f" and has {len(state.joints)}"
            raise InvalidInput(f"states.{i}.joints", state.joints, reason)
        row[:3], row[3:7] = state.root.position, _unit(state.root.orientation, i)
        row[coordinates] = state.joints
    return result


def _limbs_by_joint(model: pin.Model, plan: ContactPlan) -> dict[int, str]:
    """Return the name of the limb of each joint that has a contact frame on its links."""
    limbs: dict[int, str] = {}
    for i, state in enumerate(plan.states):
        for k, contact in enumerate(state.contacts):
            if not model.existFrame(contact.frame):
                reason = f"is not a frame of {plan.robot.urdf}"
                raise InvalidInput(f"states.{i}.contacts.{k}.frame", contact.frame, reason)
            limbs[model.frames[model.getFrameId(contact.frame)].parentJoint] = contact.limb
    return limbs


def _joint_coordinates(model: pin.Model, names: tuple[str, ...]) -> list[int]:
    """Return the index in a configuration of each named joint."""
    if sorted(names) != sorted(model.names[2:]):
        known = ", ".join(model.names[2:])
        raise InvalidInput("robot.joint_names", names, f"must be the joints of the URDF: {known}")
    joints = [model.joints[model.getJointId(name)] for name in names]
    for name, joint in zip(names, joints, strict=True):
        if joint.nq != 1:
            reason = f"joint {name} has {joint.nq} coordinates;"
            reason += " only joints with one coordinate can be shown"
            raise InvalidInput("robot.joint_names", names, reason)
    return [joint.idx_q for joint in joints]


def _unit(quaternion: tuple[float, ...], state: int) -> Array:
    """Return the normalised root quaternion of a state."""
    array = np.array(quaternion)
    norm = float(np.linalg.norm(array))
    if abs(norm - 1) > QUATERNION_TOLERANCE:
        reason = f"must be a unit quaternion [x, y, z, w], its norm is {norm:g}"
        raise InvalidInput(f"states.{state}.root.orientation", quaternion, reason)
    return array / norm
