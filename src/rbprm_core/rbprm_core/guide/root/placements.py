"""World placements of the joints that the root configuration moves."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.robot.model import ROOT_JOINT, Robot

Array = NDArray[np.float64]


class RootPlacements:
    """Places some joints for a root configuration. Not thread-safe: it holds scratch data.

    Args:
        joints: ids; the root's, or of joints that move with the root configuration alone.
    """

    def __init__(self, robot: Robot, joints: Sequence[int]) -> None:
        self._robot, self._joints = robot, tuple(joints)
        self._fixed = all(joint == ROOT_JOINT for joint in self._joints)
        self._data = robot.model.createData()
        self._q = robot.reference.copy()

    def at(self, root: Array) -> list[coal.Transform3s]:
        """Placements of the joints, in their order, at a root configuration (7 + j,)."""
        if self._fixed:  # nothing to compute
            base = coal.Transform3s(pin.Quaternion(root[3:7]).matrix(), root[:3])
            return [base] * len(self._joints)
        self._q[self._robot.root_index] = root
        pin.forwardKinematics(self._robot.model, self._data, self._q)
        found = [self._data.oMi[joint] for joint in self._joints]
        return [coal.Transform3s(place.rotation, place.translation) for place in found]
