"""Collision tests of the robot in a scene: one limb at a time, against all that it can touch."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import coal
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.broadphase import PairGroup
from rbprm_core.budget import Budget
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

Shapes = Sequence[coal.CollisionGeometry]

LIFT = 1e-3
"""Metres by which a limb in contact is lifted off its surface before it is tested.

The touched facet then is no collision, all other facets still are. Half of the depth that the check
of a plan allows.
"""


class CollisionModel:
    """Collision tests of one robot in one scene. Not thread-safe: it holds scratch data.

    Args:
        data: the robot with its collision bodies.
        scene: the environment.
        budget: polled while the tests are set up; None for no limit.
    """

    def __init__(self, data: RobotData, scene: Scene, budget: Budget | None = None) -> None:
        bodies, model = data.bodies, data.robot.model
        self._model = model
        self._data = model.createData()

        def own(limb: int) -> list[int]:
            return [i for i in range(bodies.hulls) if bodies.owner[i] == limb]

        def group(
            pairs: list[tuple[int, int]], against: Sequence[int] = (), obstacles: Shapes = ()
        ) -> PairGroup:
            if budget is not None:
                budget.poll()
            return PairGroup(model, bodies.objects, pairs, against, obstacles)

        limbs = range(len(data.robot.limbs))
        self._ends = [[i for i in own(k) if bodies.last[i]] for k in limbs]
        self._hits = [group([], own(k), scene.shapes) for k in limbs]
        self._own = [group(bodies.limb_pairs(k)) for k in limbs]
        self._between = {
            frozenset((k, j)): group(bodies.pairs_between(k, j)) for k in limbs for j in range(k)
        }
        self._root = group(bodies.limb_pairs(-1), own(-1), scene.shapes)

    def root_free(self, q: Array) -> bool:
        """True where the root part is free of collision with the environment and itself.

        Args:
            q: (nq,) configuration.
        """
        pin.forwardKinematics(self._model, self._data, q)
        return not self._root.collides(self._data)

    def limb_free(
        self, q: Array, limb: int, normal: Array | None, ignored: Iterable[int] = ()
    ) -> bool:
        """True where a limb is free of collision with the environment and the rest of the robot.

        Args:
            q: (nq,) configuration.
            limb: index of the limb.
            normal: (3,) normal of the surface that the limb touches, None where it touches none.
            ignored: indices of limbs that are not tested against, since their posture is not
                known yet.
        """
        pin.forwardKinematics(self._model, self._data, q)
        lifted = () if normal is None else self._ends[limb]
        lift = None if normal is None else LIFT * normal
        if self._hits[limb].collides(self._data, lifted, lift):
            return False
        if self._own[limb].collides(self._data):
            return False
        others = set(range(len(self._own))) - {limb, *ignored}
        return not any(
            self._between[frozenset((limb, k))].collides(self._data) for k in sorted(others)
        )
