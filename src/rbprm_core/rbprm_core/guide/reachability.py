"""The reachability condition: close enough to make contact, not so close as to collide.

Equation (4) with a requirement per limb: the scaled trunk W0_s is free, and the workspace Wk of
every required limb meets a surface that the limb may use.
"""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.guide.space import distance, interpolate
from rbprm_core.robot.bodies import convex
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.scene import Scene

Array = NDArray[np.float64]

AVOIDED = 0.12  # metres (rotations count as in `distance`)


class Reachability:
    """The condition for one robot in one scene. Not thread-safe: it holds scratch data.

    Args:
        required: names of the limbs whose workspace must meet a surface.
    """

    def __init__(self, data: RobotData, scene: Scene, required: tuple[str, ...]) -> None:
        self._robot = data.robot
        self._scene = scene
        self._trunk = [(piece.joint, convex(piece.corners)) for piece in data.trunk]
        inner = [piece.corners for piece in data.trunk if piece.joint == ROOT_JOINT]
        self._trunk_middle = np.mean(np.concatenate(inner), axis=0) if inner else np.zeros(3)
        self._limbs = [
            (limb, convex(data.workspaces[k]), scene.surfaces_shape(limb.surfaces))
            for k, limb in enumerate(data.robot.limbs)
            if limb.name in required
        ]
        self._joints = [j for j, _ in self._trunk] + [limb.base for limb, _, _ in self._limbs]
        self._fixed = all(joint == ROOT_JOINT for joint in self._joints)
        self._data = data.robot.model.createData()
        self._q = data.robot.reference.copy()
        self._still = coal.Transform3s()
        self._request, self._result = coal.CollisionRequest(), coal.CollisionResult()
        self._avoided = np.zeros((0, len(data.robot.root_index)))

    def avoid(self, root: Array, keep: tuple[Array, ...]) -> None:
        """Take a root configuration, and what lies within AVOIDED metres, as a false positive.

        The condition is an approximation; a root at which the sequence stopped has shown it wrong
        there, and the next guide has to pass it by. Nothing near the configurations to keep (start
        and goal) is avoided, or there would be no guide at all.
        """
        if all(float(distance(root, kept)) > AVOIDED for kept in keep):
            self._avoided = np.vstack([self._avoided, root])

    def holds(self, root: Array) -> bool:
        """True where the condition holds at a root configuration (7 + j,)."""
        if len(self._avoided) and float(distance(self._avoided, root).min()) < AVOIDED:
            return False
        placements = self._placements(root)
        if self._trunk_hits(placements):
            return False
        return all(
            shape is not None and self._meets(workspace, placement, shape)
            for (_, workspace, shape), placement in zip(
                self._limbs, placements[len(self._trunk) :], strict=True
            )
        )

    def failure(self, root: Array) -> tuple[str, str]:
        """Limb ("" for the trunk) and reason why the condition fails; ("", "") where it holds."""
        placements = self._placements(root)
        rotation = pin.Quaternion(root[3:7]).matrix()
        if self._scene.encloses(rotation @ self._trunk_middle + root[:3]):
            return "", "the trunk is inside an obstacle"
        if self._trunk_hits(placements):
            scale = self._robot.description.volumes.trunk_scale
            return "", f"the trunk, scaled by {scale:g}, collides with the environment"
        for (limb, workspace, shape), placement in zip(
            self._limbs, placements[len(self._trunk) :], strict=True
        ):
            kinds = " or ".join(limb.surfaces)
            if shape is None:
                return limb.name, f"the environment has no {kinds} surface for limb {limb.name}"
            if not self._meets(workspace, placement, shape):
                return limb.name, f"no {kinds} surface in the workspace of limb {limb.name}"
        return "", ""

    def edge_holds(self, a: Array, b: Array, steps: int) -> bool:
        """True where the condition holds at `steps` points from a (left out) to b (included).

        Coarse to fine: an edge that fails mostly fails near its middle.
        """
        order = np.zeros(0, dtype=int)
        stride = 1 << max(steps - 1, 1).bit_length()
        while stride >= 1:
            fresh = np.arange(stride, steps + 1, stride)
            order = np.concatenate([order, fresh[~np.isin(fresh, order)]])
            stride //= 2
        return all(self.holds(interpolate(a, b, i / steps)) for i in order)

    def _trunk_hits(self, placements: list[coal.Transform3s]) -> bool:
        return any(
            self._meets(piece, placement, self._scene.shape)
            for (_, piece), placement in zip(self._trunk, placements, strict=False)
        )

    def _placements(self, root: Array) -> list[coal.Transform3s]:
        """World placements of the joints that carry the trunk's pieces, then the limbs."""
        if self._fixed:
            base = coal.Transform3s(pin.Quaternion(root[3:7]).matrix(), root[:3])
            return [base] * len(self._joints)
        self._q[self._robot.root_index] = root
        pin.forwardKinematics(self._robot.model, self._data, self._q)
        found = [self._data.oMi[joint] for joint in self._joints]
        return [coal.Transform3s(place.rotation, place.translation) for place in found]

    def _meets(
        self, body: coal.ShapeBase, placement: coal.Transform3s, mesh: coal.BVHModelBase
    ) -> bool:
        self._result.clear()
        coal.collide(body, placement, mesh, self._still, self._request, self._result)
        return bool(self._result.isCollision())
