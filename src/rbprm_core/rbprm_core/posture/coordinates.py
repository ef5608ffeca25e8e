"""The coordinates of a robot that a posture generator may move, with their limits."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, IntArray
from rbprm_core.robot import Robot

ROOT_DOF = 6


class Coordinates:
    """Tangent coordinates of a robot: six of the root, then the joints that limbs and root use.

    All other joints keep their position; they take no part in the search.

    Args:
        robot: the robot.

    Attributes:
        moving: (k,) indices of the moving coordinates in the tangent space, the root's first.
    """

    def __init__(self, robot: Robot) -> None:
        model = robot.model
        joints = sorted(
            {*robot.root_joints, *(int(j) for limb in robot.limbs for j in limb.joints)}
        )
        self._model = model
        self._q_index = np.array([model.joints[j].idx_q for j in joints], dtype=int)
        v_index = [model.joints[j].idx_v for j in joints]
        self.moving: IntArray = np.array([*range(ROOT_DOF), *v_index], dtype=int)
        self._low, self._high = robot.low[self._q_index], robot.high[self._q_index]
        self._step = np.zeros(model.nv)
        self._free = np.full(len(self.moving), -np.inf)

    @property
    def size(self) -> int:
        """Number of moving coordinates."""
        return len(self.moving)

    def bounds(self, q: Array) -> tuple[Array, Array]:
        """Bounds (k,), (k,) of a step that keeps the joint limits; the root is free.

        Args:
            q: (nq,) configuration, inside the joint limits.
        """
        low, high = self._free.copy(), -self._free
        joints = q[self._q_index]
        low[ROOT_DOF:] = np.minimum(self._low - joints, 0.0)
        high[ROOT_DOF:] = np.maximum(self._high - joints, 0.0)
        return low, high

    def moved(self, q: Array, step: Array) -> Array:
        """The configuration (nq,) after a step.

        Args:
            q: (nq,) configuration.
            step: (k,) step of the moving coordinates.
        """
        self._step[self.moving] = step
        return np.asarray(pin.integrate(self._model, q, self._step))

    def difference(self, start: Array, end: Array) -> Array:
        """The step (k,) from one configuration to another.

        Args:
            start: (nq,) configuration.
            end: (nq,) configuration.
        """
        return np.asarray(pin.difference(self._model, start, end))[self.moving]
