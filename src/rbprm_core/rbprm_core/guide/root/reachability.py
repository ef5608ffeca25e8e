"""The reachability condition: close enough to make contact, not so close as to collide.

Tonneau et al. 2018, equation (4), with a requirement per limb: the scaled trunk $W_0^s$ is free of
collision, and the workspace $W_k$ of every required limb meets a surface that the limb may use.
"""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, IntArray
from rbprm_core.budget import Budget
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.root.root_equilibrium import EquilibriumTest
from rbprm_core.guide.root.root_kinematics import RootKinematics
from rbprm_core.guide.root.trunk import TrunkTest, lever_arms
from rbprm_core.guide.root_space import RootSegment, distance
from rbprm_core.robot.bodies import convex
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.scene import Scene

AVOIDED_RADIUS = 0.12  # m (rotations count as in `distance`)
AVOIDED_SHARE = 0.2  # of the limbs' reach; for robots so small that this is less, such as a hand
EQUILIBRIUM_INTERVAL = 4  # equilibrium, which is expensive, is tested at every fourth point


class Reachability:
    """Reachability condition of one robot in one scene.

    Not thread-safe: it holds scratch data.

    Args:
        data: robot with its trunk volumes and limb workspaces.
        scene: scene in the planning frame.
        required: names of the limbs whose workspace must meet a surface.
        equilibrium: further condition on tested roots; None for none.
        budget: polled at every test; None for no limit.

    Attributes:
        radius: distance from the root's position within which the scene decides about the
            condition, m.
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
        self._bases = RootKinematics(data.robot, [limb.base for limb, _, _ in self._limbs])
        reaches = [
            lever_arms(data.robot, limb.base, data.workspaces[k])[0]
            for k, limb in enumerate(data.robot.limbs)
            if limb.name in required
        ]
        self.radius = max(self._trunk.radius, *reaches, 0.0)
        reach = max(float(np.linalg.norm(w, axis=1).max()) for w in data.workspaces)
        self._avoided_radius = min(AVOIDED_RADIUS, AVOIDED_SHARE * reach)
        self._equilibrium = equilibrium
        self._still = coal.Transform3s()
        self._request, self._result = coal.CollisionRequest(), coal.CollisionResult()
        self._avoided = np.zeros((0, len(data.robot.root_index)))

    def avoid(self, root: Array, keep: tuple[Array, ...]) -> None:
        """Treat a root configuration and its neighbourhood as a false positive of the condition.

        The condition is an approximation. A root at which a contact sequence stopped has shown it
        wrong, so that the next guide must avoid all roots within `AVOIDED_RADIUS` of it, or less
        for a small robot. Near the roots to keep (start and goal) nothing is avoided, because no
        guide would be left.

        Args:
            root: (7 + j,) root configuration to avoid.
            keep: root configurations (7 + j,) that stay valid.
        """
        if all(float(distance(root, kept)) > self._avoided_radius for kept in keep):
            self._avoided = np.vstack([self._avoided, root])

    def forget(self) -> None:
        """Avoid no root configuration any more."""
        self._avoided = self._avoided[:0]

    def avoids(self, roots: Array) -> bool:
        """True where any of some root configurations is near an avoided one.

        Args:
            roots: (n, 7 + j) root configurations.
        """
        return any(
            float(distance(roots, avoided).min()) < self._avoided_radius
            for avoided in self._avoided
        )

    def holds(self, root: Array) -> bool:
        """True where the condition holds at a root configuration.

        Args:
            root: (7 + j,) root configuration.
        """
        self._budget.poll()
        return (
            not self.avoids(root[None])
            and not self._trunk.hits(root)
            and self._reaches(root)
            and self._balances(root)
        )

    def failure(self, root: Array) -> Failure | None:
        """Why the condition fails at a root configuration, None where it holds.

        Args:
            root: (7 + j,) root configuration.
        """
        blocked = self.trunk_failure(root)
        if blocked is not None:
            return blocked
        for (limb, workspace, shape), placement in zip(
            self._limbs, self._bases.placements(root), strict=True
        ):
            kinds = tuple(str(kind) for kind in limb.surfaces)
            if shape is None:
                return Failure.of(Cause.NO_SURFACE_OF_KIND, limb.name, kinds=kinds)
            if not self._meets(workspace, placement, shape):
                return Failure.of(Cause.NO_SURFACE_IN_WORKSPACE, limb.name, kinds=kinds)
        if not self._balances(root):
            return Failure.of(Cause.WEIGHT_UNSUPPORTED)
        return None

    def trunk_failure(self, root: Array) -> Failure | None:
        """Why the trunk volume cannot be at a root configuration, None where it can.

        Args:
            root: (7 + j,) root configuration.
        """
        rotation = pin.Quaternion(root[3:7]).matrix()
        if self._scene.encloses(rotation @ self._trunk_middle + root[:3]):
            return Failure.of(Cause.TRUNK_IN_OBSTACLE)
        if self._trunk.hits(root):
            scale = self._robot.description.volumes.trunk_scale
            return Failure.of(Cause.TRUNK_COLLISION, scale=scale)
        return None

    def edge_holds(self, edge: RootSegment, steps: int) -> bool:
        """True where the condition holds on an edge whose first root is known to be valid.

        The trunk is tested along the whole edge, the limbs' reach at points, and equilibrium at
        some of these points. Points go from coarse to fine, because an edge that fails mostly
        fails at its end or near its middle.

        Args:
            edge: edge between two root configurations.
            steps: number of points, evenly spaced, the edge's end being the last.
        """
        self._budget.poll()
        roots = edge.at_all(_coarse_to_fine(steps) / steps)
        return (
            not self.avoids(roots)
            and self._reaches(roots[0])
            and not self._trunk.sweep_hits(edge)
            and all(self._reaches(root) for root in roots[1:])
            and all(self._balances(root) for root in roots[: -(-steps // EQUILIBRIUM_INTERVAL)])
        )

    def _reaches(self, root: Array) -> bool:
        """True where every required limb reaches a surface."""
        return all(
            shape is not None and self._meets(workspace, placement, shape)
            for (_, workspace, shape), placement in zip(
                self._limbs, self._bases.placements(root), strict=True
            )
        )

    def _balances(self, root: Array) -> bool:
        """True where equilibrium is possible or not required."""
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


def _coarse_to_fine(steps: int) -> IntArray:
    """Numbers 1 to `steps`, the last one first, then those that halve the remaining gaps."""
    numbers = np.arange(1, steps + 1)
    even = np.where(numbers == steps, steps * 2, numbers & -numbers)  # largest power of 2 within
    return np.asarray(numbers[np.argsort(-even, kind="stable")])
