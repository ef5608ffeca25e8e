"""Kinematics of one limb on its own joints: a model of n joints instead of the whole robot's."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]


class LimbKinematics:
    """Effector placement and Jacobian of a limb in the frame of the joint it hangs on.

    Not thread-safe: it holds pinocchio's scratch data.

    Args:
        model: of the whole robot.
        base: id of the joint that the limb hangs on.
        joints: (n,) ids of the limb's joints.
        frame: id of the effector frame. center: (3,) contact centre in that frame.
    """

    def __init__(
        self, model: pin.Model, base: int, joints: NDArray[np.int_], frame: int, center: Array
    ) -> None:
        lock = [i for i in range(1, model.njoints) if i not in joints]
        self._model = pin.buildReducedModel(model, lock, pin.neutral(model))
        tip = model.frames[frame].placement * pin.SE3(np.eye(3), center)
        kind, inertia = pin.FrameType.OP_FRAME, pin.Inertia.Zero()
        self._tip = self._model.addFrame(pin.Frame("contact", len(joints), tip, kind, inertia))
        self._data = self._model.createData()
        # Joints between root and base are locked at zero here; measured from the base, they and
        # the root do not matter.
        whole = model.createData()
        pin.forwardKinematics(model, whole, pin.neutral(model))
        self._from_base = whole.oMi[base].inverse()
        self._base_rotation = self._from_base.rotation.copy()
        self._base_translation = self._from_base.translation.copy()

    def position_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Contact centre (3,) in metres and its Jacobian (3, n) in the base frame (equation 10)."""
        jacobian = pin.computeFrameJacobian(
            self._model, self._data, q, self._tip, pin.LOCAL_WORLD_ALIGNED
        )
        position = self._data.oMf[self._tip].translation
        rotation = self._base_rotation
        return rotation @ position + self._base_translation, rotation @ jacobian[:3]
