"""Forward kinematics of one limb: a model of its n joints alone instead of the whole robot's."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, IntArray

FIRST = 1  # id of the limb's first joint in the model of the limb alone


class LimbKinematics:
    """Placement and Jacobian of a limb's contact frame in the limb's base frame.

    The base frame is the frame of the joint that the limb is attached to. An instance is not
    thread-safe, since it holds pinocchio's scratch data.

    Args:
        model: kinematic model of the whole robot.
        reference: (nq,) reference posture, in which all other joints stay.
        base: id of the joint that the limb is attached to.
        joints: (n,) ids of the limb's joints, from the base outwards.
        frame: id of the effector frame.
        contact: placement of the contact frame in the effector frame.

    Attributes:
        mass: mass of the limb and of all links beyond it, kilograms.
    """

    def __init__(
        self,
        model: pin.Model,
        reference: Array,
        base: int,
        joints: IntArray,
        frame: int,
        contact: pin.SE3,
    ) -> None:
        lock = [i for i in range(1, model.njoints) if i not in joints]
        self._model = pin.buildReducedModel(model, lock, reference)
        tip = model.frames[frame].placement * contact
        kind, inertia = pin.FrameType.OP_FRAME, pin.Inertia.Zero()
        self._tip = self._model.addFrame(pin.Frame("contact", len(joints), tip, kind, inertia))
        self._data = self._model.createData()
        self.mass = float(sum(model.inertias[j].mass for j in model.subtrees[int(joints[0])]))
        # Joints between root and base are locked, too. Neither they nor the root change poses
        # relative to the base.
        whole = model.createData()
        pin.forwardKinematics(model, whole, reference)
        self._from_base = whole.oMi[base].inverse()
        self._base_rotation = self._from_base.rotation.copy()
        self._base_translation = self._from_base.translation.copy()

    def placement_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """Pose of the contact frame in the base frame, and its Jacobian.

        Args:
            q: (n,) joint positions of the limb, radians or metres.

        Returns:
            Position (3,) in metres, rotation (3, 3), and Jacobian (6, n) in the base frame: linear
            velocity in the first three rows, angular velocity in the last three.
        """
        jacobian = pin.computeFrameJacobian(
            self._model, self._data, q, self._tip, pin.LOCAL_WORLD_ALIGNED
        )
        placement = self._data.oMf[self._tip]
        rotation = self._base_rotation
        turned = np.empty_like(jacobian)
        turned[:3] = rotation @ jacobian[:3]
        turned[3:] = rotation @ jacobian[3:]
        position = rotation @ placement.translation + self._base_translation
        return position, rotation @ placement.rotation, turned

    def com(self, q: Array) -> Array:
        """Centre of mass (3,) of the limb and of all links beyond it, in the base frame, metres.

        Args:
            q: (n,) joint positions of the limb, radians or metres.
        """
        pin.centerOfMass(self._model, self._data, q, True)
        first = self._data.oMi[FIRST].act(self._data.com[FIRST])
        return np.asarray(self._base_rotation @ first + self._base_translation)

    def position_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        r"""Origin of the contact frame in the base frame, and its Jacobian.

        The Jacobian is $J$ of $\dot{p} = J(q) \dot{q}$ (Tonneau et al. 2018, equation 10).

        Args:
            q: (n,) joint positions of the limb, radians or metres.

        Returns:
            Position (3,) in metres, and Jacobian (3, n) in the base frame.
        """
        jacobian = pin.computeFrameJacobian(
            self._model, self._data, q, self._tip, pin.LOCAL_WORLD_ALIGNED
        )
        position = self._data.oMf[self._tip].translation
        rotation = self._base_rotation
        return rotation @ position + self._base_translation, rotation @ jacobian[:3]
