"""Forward kinematics of the joints that the root configuration alone determines."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.robot.model import ROOT_JOINT, Robot


class RootKinematics:
    """Forward kinematics of some joints from the root configuration.

    Not thread-safe: it holds scratch data.

    Args:
        robot: robot model.
        joints: ids of the root joint or of joints that move with the root configuration alone.
    """

    def __init__(self, robot: Robot, joints: Sequence[int]) -> None:
        self._robot, self._joints = robot, tuple(joints)
        self._fixed = all(joint == ROOT_JOINT for joint in self._joints)
        self._data = robot.model.createData()
        self._q = robot.reference.copy()

    def placements(self, root: Array) -> list[coal.Transform3s]:
        """Placements of the joints in the planning frame, in the order of the joints.

        Args:
            root: (7 + j,) root configuration.
        """
        if self._fixed:  # the placement is the root's pose itself
            base = coal.Transform3s(pin.Quaternion(root[3:7]).matrix(), root[:3])
            return [base] * len(self._joints)
        self._q[self._robot.root_index] = root
        pin.forwardKinematics(self._robot.model, self._data, self._q)
        found = [self._data.oMi[joint] for joint in self._joints]
        return [coal.Transform3s(place.rotation, place.translation) for place in found]
