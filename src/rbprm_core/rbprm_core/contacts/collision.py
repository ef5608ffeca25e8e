"""Collision of the robot in a scene: one limb at a time, against what it can touch."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

Array = NDArray[np.float64]

LIFT = 1e-3
"""Metres by which a limb in contact is lifted off its surface before it is tested.

The touching facet then is no collision, while everything else still is; half of the depth that a
plan's check allows.
"""


class CollisionModel:
    """Tests of one robot in one scene. Not thread-safe: it holds scratch data."""

    def __init__(self, data: RobotData, scene: Scene) -> None:
        bodies, limbs = data.bodies, range(len(data.robot.limbs))
        self._model = data.robot.model
        self._data = self._model.createData()
        ground = pin.GeometryObject("environment", 0, pin.SE3.Identity(), scene.shape)
        environment = len(bodies.objects)
        self._ends = [
            [i for i in range(bodies.hulls) if bodies.owner[i] == k and bodies.last[i]]
            for k in limbs
        ]
        self._hits = []
        for k in limbs:
            hits = [(i, environment) for i in range(bodies.hulls) if bodies.owner[i] == k]
            self._hits.append(bodies.model(hits, [ground]))
        self._limbs = [bodies.model(bodies.limb_pairs(k, others=True)) for k in limbs]
        hits = [(i, environment) for i in range(bodies.hulls) if bodies.owner[i] == -1]
        self._root = bodies.model(hits + bodies.limb_pairs(-1, others=False), [ground])
        self._hit_scratch = [geometry.createData() for geometry in self._hits]
        self._limb_scratch = [geometry.createData() for geometry in self._limbs]
        self._root_scratch = self._root.createData()

    def root_free(self, q: Array) -> bool:
        """True where the root part is clear of the environment (and of itself)."""
        pin.updateGeometryPlacements(self._model, self._data, self._root, self._root_scratch, q)
        return not pin.computeCollisions(self._root, self._root_scratch, True)

    def limb_free(self, q: Array, limb: int, normal: Array | None) -> bool:
        """True where a limb is clear of the environment and of the rest of the robot.

        Args:
            normal: (3,) of the surface that the limb touches, None where it touches none.
        """
        geometry, scratch = self._hits[limb], self._hit_scratch[limb]
        pin.updateGeometryPlacements(self._model, self._data, geometry, scratch, q)
        if normal is not None:
            for i in self._ends[limb]:
                scratch.oMg[i].translation += LIFT * normal
        if pin.computeCollisions(geometry, scratch, True):
            return False
        geometry, scratch = self._limbs[limb], self._limb_scratch[limb]
        pin.updateGeometryPlacements(self._model, self._data, geometry, scratch)
        return not pin.computeCollisions(geometry, scratch, True)
