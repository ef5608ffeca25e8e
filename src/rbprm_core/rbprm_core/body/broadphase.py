"""Collision of many pairs of bodies at once: boxes are compared before shapes are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.errors import RbprmError

Array = NDArray[np.float64]

THICKNESS = 1e-3  # metres, added to the boxes: pinocchio leaves out a body whose box is flat


class PairGroup:
    """Some bodies of a robot, some obstacles, and the pairs of them to test.

    Not thread-safe: it holds scratch data.

    Args:
        model: of the robot. objects: all its bodies. pairs: indices into `objects`.
        against: indices of the objects that are tested against every obstacle.
        obstacles: shapes in the planning frame.
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
            data: of the robot's model, forward kinematics done.
            lifted: bodies moved by `lift` (3,) in the planning frame before they are tested.
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
