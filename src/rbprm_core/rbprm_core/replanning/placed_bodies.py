"""Collision bodies of a robot in all states of a sequence, placed once."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.collision import LIFT
from rbprm_core.body.state import State
from rbprm_core.robot.data import RobotData


class PlacedBodies:
    """All convex hulls of a robot, placed in all states of a sequence.

    A limb in contact is lifted off its surface (`rbprm_core.body.collision.LIFT`).

    Args:
        data: the robot with its collision bodies.
        states: the states of the sequence.

    Attributes:
        owner: (b,) index of the limb of each hull, -1 for the root part.
        names: names of the hulls.
    """

    def __init__(self, data: RobotData, states: Sequence[State]) -> None:
        bodies, model = data.bodies, data.robot.model
        objects = bodies.objects[: bodies.hulls]
        self.owner = bodies.owner[: bodies.hulls]
        self.names = [body.name for body in objects]
        self._shapes = [body.geometry for body in objects]
        for shape in self._shapes:
            shape.computeLocalAABB()
        low = np.array([shape.aabb_local.min_ for shape in self._shapes])
        high = np.array([shape.aabb_local.max_ for shape in self._shapes])
        rotations, places = _joint_placements(model, states)
        joints = [body.parentJoint for body in objects]
        turns = np.array([body.placement.rotation for body in objects])
        shifts = np.array([body.placement.translation for body in objects])
        self._rotations = rotations[:, joints] @ turns
        self._places = places[:, joints] + np.einsum("sbij,bj->sbi", rotations[:, joints], shifts)
        last = bodies.last[: bodies.hulls]
        for i, state in enumerate(states):
            for contact in state.contacts:
                self._places[i, last & (self.owner == contact.limb)] += LIFT * contact.normal
        middle = np.einsum("sbij,bj->sbi", self._rotations, (low + high) / 2) + self._places
        extent = np.einsum("sbij,bj->sbi", np.abs(self._rotations), (high - low) / 2)
        self._low, self._high = middle - extent, middle + extent
        self._request = coal.CollisionRequest()
        # Without contacts coal gives up on some pairs that are millimetres deep in each other.
        self._request.enable_contact = True

    def collisions(self, shapes: Sequence[coal.BVHModelOBBRSS], first: int) -> dict[int, int]:
        """Index of a hull in collision, by index of the state.

        Args:
            shapes: shapes of the environment in the planning frame.
            first: index of the first state to test.
        """
        identity, found = coal.Transform3s(), dict[int, int]()
        for shape in shapes:
            shape.computeLocalAABB()
            low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
            near = (self._low[first:] <= high) & (self._high[first:] >= low)
            for state, body in np.argwhere(near.all(axis=2)):
                i = first + int(state)
                if i in found:
                    continue
                pose = coal.Transform3s(self._rotations[i, body], self._places[i, body])
                result = coal.CollisionResult()
                coal.collide(self._shapes[body], pose, shape, identity, self._request, result)
                if result.isCollision():
                    found[i] = int(body)
        return found


def _joint_placements(model: pin.Model, states: Sequence[State]) -> tuple[Array, Array]:
    """Rotations (s, j, 3, 3) and positions (s, j, 3) of all joints in the planning frame."""
    data = model.createData()
    rotations = np.empty((len(states), model.njoints, 3, 3))
    places = np.empty((len(states), model.njoints, 3))
    for i, state in enumerate(states):
        pin.forwardKinematics(model, data, state.q)
        for j in range(model.njoints):
            rotations[i, j], places[i, j] = data.oMi[j].rotation, data.oMi[j].translation
    return rotations, places
