"""A robot in a scene as posture problems use it."""

from __future__ import annotations

import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.torques import TorqueModel
from rbprm_core.posture.body_pairs import BodyPairs
from rbprm_core.posture.coordinates import Coordinates
from rbprm_core.posture.kinematics import Kinematics
from rbprm_core.posture.protocol import PostureSetting

REACH = 0.03
"""Distance up to which pairs of bodies get rows, metres."""


class PostureModel:
    """Data that all posture problems of one robot in one scene share. Not thread-safe.

    Args:
        setting: robot and scene.

    Attributes:
        robot: the robot.
        stability: robustness of contact sets.
        coordinates: moving coordinates of the robot.
        pairs: pairs of bodies that can collide.
        torques: static torques of the robot.
    """

    def __init__(self, setting: PostureSetting) -> None:
        self.robot, self.stability = setting.body.robot, setting.body.stability
        self.coordinates = Coordinates(self.robot)
        self.pairs = BodyPairs(setting.data, setting.scene, REACH)
        self.torques = TorqueModel(self.robot, setting.gravity)
        self._data: pin.Data = self.robot.model.createData()

    def kinematics(self, q: Array) -> Kinematics:
        """The robot at a configuration, valid until the next call.

        Args:
            q: (nq,) configuration.
        """
        return Kinematics(self.robot, self._data, q)
