"""Tasks of a user: equalities and inequalities on links of the robot."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.rows import ByRows, Rows
from rbprm_core.posture.kinematics import Kinematics, cross
from rbprm_core.robot import Robot


def _frame(robot: Robot, name: str) -> int:
    if not robot.model.existFrame(name):
        raise InvalidInput("task.frame", name, "is no frame of the robot")
    return int(robot.model.getFrameId(name))


class Upright(ByRows):
    """An axis of a frame stays within an angle of a direction of the planning frame.

    Args:
        robot: the robot.
        frame: name of the frame.
        axis: (3,) axis in the frame, of any length.
        direction: (3,) direction in the planning frame, of any length.
        max_angle: largest angle between them, radians, below a quarter turn.

    Raises:
        InvalidInput: an unknown frame.
    """

    tolerance = 1e-5

    def __init__(
        self, robot: Robot, frame: str, axis: Array, direction: Array, max_angle: float
    ) -> None:
        self._name, self._frame = frame, _frame(robot, frame)
        self._axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
        self._direction = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        self._min_cosine = float(np.cos(max_angle))

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`."""
        frame, jacobian = kinematics.frame(self._frame)
        axis = frame.rotation @ self._axis
        gradient = cross(axis, self._direction) @ jacobian[3:]
        missing = self._min_cosine - float(axis @ self._direction)
        return Rows(gradient[None], np.array([missing]), np.array([np.inf]))

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        return Failure.of(Cause.TASK_NOT_MET, body=f"{self._name} upright", violation=violation)


class PointInBox(ByRows):
    """A point of a frame stays in a box of the planning frame; equal bounds fix a coordinate.

    Args:
        robot: the robot.
        frame: name of the frame.
        point: (3,) point in the frame, metres.
        low: (3,) smallest coordinates, metres, minus infinity for none.
        high: (3,) largest coordinates, metres, infinity for none.

    Raises:
        InvalidInput: an unknown frame.
    """

    tolerance = 1e-5

    def __init__(self, robot: Robot, frame: str, point: Array, low: Array, high: Array) -> None:
        self._name, self._frame = frame, _frame(robot, frame)
        self._point = np.asarray(point, dtype=float)
        self._low, self._high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`."""
        frame, jacobian = kinematics.frame(self._frame)
        arm = frame.rotation @ self._point
        place = frame.translation + arm
        x, y, z = arm
        skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return Rows(jacobian[:3] - skew @ jacobian[3:], self._low - place, self._high - place)

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        return Failure.of(Cause.TASK_NOT_MET, body=f"{self._name} in box", violation=violation)
