"""The reachability condition: close enough to make contact, not so close as to collide.

Equation (4) with a requirement per limb: the scaled trunk W0_s is free, and the workspace Wk of
every required limb meets a surface that the limb may use.
"""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.guide.root.equilibrium import EquilibriumTest
from rbprm_core.guide.root.placements import RootPlacements
from rbprm_core.guide.root.trunk import TrunkTest, levers
from rbprm_core.guide.root_space import StraightWay, distance
from rbprm_core.robot.bodies import convex
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.scene import Scene

Array = NDArray[np.float64]

AVOIDED = 0.12  # metres (rotations count as in `distance`)
AVOIDED_SHARE = 0.2  # of the limbs' reach, for robots so small that it is less, such as a hand
SPARSE = 4  # points of an edge for one at which equilibrium, the dear part, is tested


class Reachability:
    """The condition for one robot in one scene. Not thread-safe: it holds scratch data.

    Args:
        required: names of the limbs whose workspace must meet a surface.
        equilibrium: what else must hold where a root is tested, None for the plain condition.
        budget: polled at every test; None for no limit.
    """

    def __init__(
        self,
        data: RobotData,
        scene: Scene,
        required: tuple[str, ...],
        equilibrium: EquilibriumTest | None = None,
        budget: Budget | None = None,
    ) -> None:
        self._budget = Budget() if budget is None else budget
        self._robot, self._scene = data.robot, scene
        self._trunk = TrunkTest(data.robot, data.trunk, scene.shape)
        inner = [piece.corners for piece in data.trunk if piece.joint == ROOT_JOINT]
        self._trunk_middle = np.mean(np.concatenate(inner), axis=0) if inner else np.zeros(3)
        self._limbs = [
            (limb, convex(data.workspaces[k]), scene.surfaces_shape(limb.surfaces))
            for k, limb in enumerate(data.robot.limbs)
            if limb.name in required
        ]
        self._bases = RootPlacements(data.robot, [limb.base for limb, _, _ in self._limbs])
        reaches = [
            levers(data.robot, limb.base, data.workspaces[k])[0]
            for k, limb in enumerate(data.robot.limbs)
            if limb.name in required
        ]
        self.radius = max(self._trunk.radius, *reaches, 0.0)
        """Metres around the root's position within which a scene decides about the condition."""
        reach = max(float(np.linalg.norm(w, axis=1).max()) for w in data.workspaces)
        self._clearance = min(AVOIDED, AVOIDED_SHARE * reach)
        self._equilibrium = equilibrium
        self._still = coal.Transform3s()
        self._request, self._result = coal.CollisionRequest(), coal.CollisionResult()
        self._avoided = np.zeros((0, len(data.robot.root_index)))

    def avoid(self, root: Array, keep: tuple[Array, ...]) -> None:
        """Take a root configuration, and what lies near it, as a false positive.

        Near is within AVOIDED metres, or less for a small robot. The condition is an approximation;
        a root at which the sequence stopped has shown it wrong there, and the next guide has to
        pass it by. Nothing near the configurations to keep (start and goal) is avoided, or there
        would be no guide at all.
        """
        if all(float(distance(root, kept)) > self._clearance for kept in keep):
            self._avoided = np.vstack([self._avoided, root])

    def forget(self) -> None:
        """Avoid nothing any more."""
        self._avoided = self._avoided[:0]

    def avoids(self, roots: Array) -> bool:
        """True where one of some root configurations (n, 7 + j) is near to an avoided one."""
        return any(
            float(distance(roots, avoided).min()) < self._clearance for avoided in self._avoided
        )

    def holds(self, root: Array) -> bool:
        """True where the condition holds at a root configuration (7 + j,)."""
        self._budget.poll()
        return (
            not self.avoids(root[None])
            and not self._trunk.hits(root)
            and self._reaches(root)
            and self._balances(root)
        )

    def failure(self, root: Array) -> tuple[str, str]:
        """Limb ("" for the trunk) and reason why the condition fails; ("", "") where it holds."""
        blocked = self.blocked(root)
        if blocked:
            return "", blocked
        for (limb, workspace, shape), placement in zip(
            self._limbs, self._bases.at(root), strict=True
        ):
            kinds = " or ".join(limb.surfaces)
            if shape is None:
                return limb.name, f"the environment has no {kinds} surface for limb {limb.name}"
            if not self._meets(workspace, placement, shape):
                return limb.name, f"no {kinds} surface in the workspace of limb {limb.name}"
        if not self._balances(root):
            return "", "no contacts within the limbs' workspaces could bear the robot's weight"
        return "", ""

    def blocked(self, root: Array) -> str:
        """Why the trunk cannot be at a root configuration, "" where it can."""
        rotation = pin.Quaternion(root[3:7]).matrix()
        if self._scene.encloses(rotation @ self._trunk_middle + root[:3]):
            return "the trunk is inside an obstacle"
        if self._trunk.hits(root):
            scale = self._robot.description.volumes.trunk_scale
            return f"the trunk, scaled by {scale:g}, collides with the environment"
        return ""

    def edge_holds(self, way: StraightWay, steps: int) -> bool:
        """True where the condition holds on a way, its beginning left out.

        The trunk is free all along; the limbs' reach is tested at `steps` points of the way, and
        equilibrium at each SPARSE-th of them. Coarse to fine: an edge that fails mostly fails at
        its end or near its middle.
        """
        self._budget.poll()
        roots = way.at_all(_coarse_to_fine(steps) / steps)
        return (
            not self.avoids(roots)
            and self._reaches(roots[0])
            and not self._trunk.sweep_hits(way)
            and all(self._reaches(root) for root in roots[1:])
            and all(self._balances(root) for root in roots[: -(-steps // SPARSE)])
        )

    def _reaches(self, root: Array) -> bool:
        """True where every required limb reaches a surface."""
        return all(
            shape is not None and self._meets(workspace, placement, shape)
            for (_, workspace, shape), placement in zip(
                self._limbs, self._bases.at(root), strict=True
            )
        )

    def _balances(self, root: Array) -> bool:
        """True where equilibrium is possible, or is not asked for."""
        if self._equilibrium is None:
            return True
        self._budget.poll()
        return self._equilibrium.holds(root)

    def _meets(
        self, body: coal.ShapeBase, placement: coal.Transform3s, mesh: coal.BVHModelBase
    ) -> bool:
        self._result.clear()
        coal.collide(body, placement, mesh, self._still, self._request, self._result)
        return bool(self._result.isCollision())


def _coarse_to_fine(steps: int) -> NDArray[np.int_]:
    """The numbers 1 to `steps`, the last first, then those that halve the gaps left."""
    numbers = np.arange(1, steps + 1)
    even = np.where(numbers == steps, steps * 2, numbers & -numbers)  # largest power of 2 within
    return np.asarray(numbers[np.argsort(-even, kind="stable")])
