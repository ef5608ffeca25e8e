"""Kinematics of the whole robot at one configuration, each quantity computed when first used."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.robot import Robot
from rbprm_core.robot.contact_spot import ContactSpot


class Kinematics:
    """The robot at a configuration. It shares scratch data: valid until the next one is made.

    Velocities are in the tangent space of the configuration: linear and angular velocity of the
    root in its own frame, then joint velocities.

    Args:
        robot: the robot.
        data: scratch data of the robot's model.
        q: (nq,) configuration.

    Attributes:
        robot: the robot.
        q: (nq,) configuration.
    """

    def __init__(self, robot: Robot, data: pin.Data, q: Array) -> None:
        self.robot, self.q, self._data = robot, q, data
        pin.computeJointJacobians(robot.model, data, q)
        self._placements: dict[tuple[int, str], tuple[pin.SE3, Array]] = {}

    def frame(self, frame: int) -> tuple[pin.SE3, Array]:
        """Placement of a frame in the planning frame, and its Jacobian (6, nv), linear part first.

        The Jacobian gives the velocity of the frame's origin and its angular velocity, both in the
        axes of the planning frame.

        Args:
            frame: id of the frame in the robot's model.
        """
        model, data = self.robot.model, self._data
        placement = pin.updateFramePlacement(model, data, frame)
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        return placement.copy(), jacobian

    def spot(self, spot: ContactSpot) -> tuple[pin.SE3, Array]:
        """Placement and Jacobian (6, nv) of the contact frame of a spot; see `frame`.

        Args:
            spot: the contact spot.
        """
        key = spot.frame, spot.name
        if key not in self._placements:
            placement, jacobian = self.frame(spot.frame)
            contact = placement * spot.placement
            arm = contact.translation - placement.translation
            moved = jacobian.copy()
            moved[:3] -= _cross_rows(arm, jacobian[3:])
            self._placements[key] = contact, moved
        return self._placements[key]

    @cached_property
    def com(self) -> Array:
        """Centre of mass (3,) in the planning frame, metres."""
        self.com_jacobian  # noqa: B018 (computes both)
        return np.asarray(self._data.com[0]).copy()

    @cached_property
    def com_jacobian(self) -> Array:
        """Jacobian (3, nv) of the centre of mass."""
        return np.asarray(pin.jacobianCenterOfMass(self.robot.model, self._data, self.q)).copy()

    @property
    def jacobians(self) -> Array:
        """Columns (6, nv) of all joints' Jacobians: velocity at the origin of the planning frame.

        A column moves the bodies that its joint supports, and no others.
        """
        return np.asarray(self._data.J)

    @property
    def data(self) -> pin.Data:
        """Pinocchio's data with the placements of all joints."""
        return self._data


def _cross_rows(arm: Array, rows: Array) -> Array:
    """Cross products arm x column (3, n) of an arm (3,) with the columns of rows (3, n)."""
    x, y, z = arm
    result = np.empty_like(rows)
    result[0] = y * rows[2] - z * rows[1]
    result[1] = z * rows[0] - x * rows[2]
    result[2] = x * rows[1] - y * rows[0]
    return result


def cross(a: Array, b: Array) -> Array:
    """The cross product (3,) of two vectors; np.cross takes ten times as long.

    Args:
        a: (3,) first vector.
        b: (3,) second vector.
    """
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])
