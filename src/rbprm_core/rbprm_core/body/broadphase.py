"""Collision tests of many pairs of bodies at once: boxes are compared before shapes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import coal
import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.errors import RbprmError

THICKNESS = 1e-3  # metres, added to the boxes: pinocchio leaves out a body whose box is flat


class PairGroup:
    """Pairs of bodies of a robot, and of bodies and obstacles, that are tested together.

    Not thread-safe: it holds scratch data.

    Args:
        model: model of the robot.
        objects: all collision bodies of the robot.
        pairs: indices into `objects` of the pairs to test against each other.
        against: indices into `objects` of the bodies to test against every obstacle.
        obstacles: shapes of the obstacles in the planning frame.

    Attributes:
        index: index in the group by index into `objects`.
    """

    def __init__(
        self,
        model: pin.Model,
        objects: Sequence[pin.GeometryObject],
        pairs: Iterable[tuple[int, int]] = (),
        against: Iterable[int] = (),
        obstacles: Sequence[coal.CollisionGeometry] = (),
    ) -> None:
        pairs, against = list(pairs), list(against)
        used = sorted({*against, *(i for pair in pairs for i in pair)})
        self.index = {body: i for i, body in enumerate(used)}
        self._model, self._geometry = model, pin.GeometryModel()
        for body in used:
            self._geometry.addGeometryObject(pin.GeometryObject(objects[body]))
        for k, shape in enumerate(obstacles if against else ()):
            place = pin.SE3.Identity()
            ground = self._geometry.addGeometryObject(
                pin.GeometryObject(f"obstacle_{k}", 0, place, shape)
            )
            for body in against:
                self._geometry.addCollisionPair(pin.CollisionPair(self.index[body], ground))
        for first, second in pairs:
            pair = pin.CollisionPair(self.index[first], self.index[second])
            self._geometry.addCollisionPair(pair)
        self._data = self._geometry.createData()
        for request in self._data.collisionRequests:
            # Without contacts coal gives up on some pairs that are millimetres deep in each other.
            request.enable_contact = True
        self._manager = pin.BroadPhaseManager_NaiveCollisionManager(
            model, self._geometry, self._data
        )
        self._thicken()

    def collides(
        self, data: pin.Data, lifted: Iterable[int] = (), lift: Array | None = None
    ) -> bool:
        """True where a pair collides.

        Args:
            data: data of the robot's model, forward kinematics done.
            lifted: indices into `objects` of the bodies to be moved before they are tested.
            lift: (3,) displacement of these bodies in the planning frame, metres.
        """
        if not len(self._geometry.collisionPairs):
            return False
        pin.updateGeometryPlacements(self._model, data, self._geometry, self._data)
        for body in lifted:
            self._data.oMg[self.index[body]].translation += lift
        self._manager.update(False)
        return bool(pin.computeCollisions(self._manager, True))

    def _thicken(self) -> None:
        # The manager has just computed the boxes; from now on it only moves them.
        for body in self._geometry.geometryObjects:
            box = body.geometry.aabb_local
            box.min_ = np.array(box.min_) - THICKNESS
            box.max_ = np.array(box.max_) + THICKNESS
        self._manager.update(False)
        if not all(self._manager.getCollisionObjectStatus()):
            raise RbprmError("a body or an obstacle is left out of the collision tests")
