"""Kinematics of one limb on its own joints: a model of n joints instead of the whole robot's."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIRST = 1  # id of a limb's first joint in the model of the limb alone


class LimbKinematics:
    """Effector placement and Jacobian of a limb in the frame of the joint it hangs on.

    Not thread-safe: it holds pinocchio's scratch data.

    Attributes:
        mass: of the limb and all that it carries, kilograms.

    Args:
        model: of the whole robot. reference: (nq,) the posture that all other joints keep.
        base: id of the joint that the limb hangs on.
        joints: (n,) ids of the limb's joints.
        frame: id of the effector frame. contact: placement of the contact frame in it.
    """

    def __init__(
        self,
        model: pin.Model,
        reference: Array,
        base: int,
        joints: NDArray[np.int_],
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
        # Joints between root and base are locked, too; measured from the base, they and the root
        # do not matter.
        whole = model.createData()
        pin.forwardKinematics(model, whole, reference)
        self._from_base = whole.oMi[base].inverse()
        self._base_rotation = self._from_base.rotation.copy()
        self._base_translation = self._from_base.translation.copy()

    def placement_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """The contact frame in the base frame, and its Jacobian (equation 10).

        Returns:
            Position (3,) in metres, rotation (3, 3), Jacobian (6, n): linear above, angular below.
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
        """Centre of mass (3,) of the limb and all that it carries, in the base frame, metres."""
        pin.centerOfMass(self._model, self._data, q, True)
        first = self._data.oMi[FIRST].act(self._data.com[FIRST])
        return np.asarray(self._base_rotation @ first + self._base_translation)

    def position_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Contact centre (3,) in metres and its Jacobian (3, n) in the base frame (equation 10)."""
        jacobian = pin.computeFrameJacobian(
            self._model, self._data, q, self._tip, pin.LOCAL_WORLD_ALIGNED
        )
        position = self._data.oMf[self._tip].translation
        rotation = self._base_rotation
        return rotation @ position + self._base_translation, rotation @ jacobian[:3]
