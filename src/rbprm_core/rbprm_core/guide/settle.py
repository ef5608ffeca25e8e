"""Settle a guide: let the root stand at its preferred height over the surfaces beneath it.

Not in the paper. The reachability condition accepts a root at any height within the limbs' reach,
and shortcuts cut straight through it; a root that rides at the reference posture's height leaves
the contact generator far more candidates than one that crouches over a block.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.guide.path import GuidePath
from rbprm_core.guide.rrt import Edge
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.vocabulary import SurfaceKind

Array = NDArray[np.float64]

SPACING = 0.1  # metres between the roots that are moved
SMOOTHING = 3  # roots on either side over which heights are averaged
PASSES = 6  # halvings of what does not hold, the last of which drops it


class Settler:
    """Preferred heights for one robot in one scene.

    Args:
        required: names of the limbs that stand on the surfaces.
    """

    def __init__(self, data: RobotData, scene: Scene, required: tuple[str, ...]) -> None:
        robot = data.robot
        scratch = robot.model.createData()
        pin.framesForwardKinematics(robot.model, scratch, robot.reference)
        limbs = [limb for limb in robot.limbs if limb.name in required]
        feet = [scratch.oMf[limb.frame].act(limb.contact.translation) for limb in limbs]
        self._feet = np.array(feet).reshape(-1, 3)
        self._feet[:, 2] -= [limb.radius for limb in limbs]
        self._pieces = scene.pieces((SurfaceKind.SUPPORT,))

    def settle(self, path: GuidePath, edge: Edge, budget: Budget) -> GuidePath:
        """The path with its inner roots moved towards their preferred heights, where that holds."""
        if len(self._feet) == 0 or path.length < 2 * SPACING:
            return path
        count = int(np.ceil(path.length / SPACING))
        roots = np.array([path.at(m) for m in np.linspace(0, path.length, count + 1)])
        lifts = self._lifts(roots)
        checked = np.zeros(count, dtype=bool)
        for i in range(PASSES):
            settled = roots.copy()
            settled[:, 2] += lifts
            for k in np.flatnonzero(~checked):
                budget.check("shortcut", i / PASSES)
                checked[k] = edge.holds(settled[k], settled[k + 1])
            if checked.all():
                return GuidePath(settled)
            touched = np.zeros(count + 1, dtype=bool)
            touched[:-1] |= ~checked
            touched[1:] |= ~checked
            lifts[touched] *= 0.5 if i < PASSES - 2 else 0.0
            moved = touched & (np.abs(lifts) > 0)
            checked &= ~(touched[:-1] | touched[1:] | moved[:-1] | moved[1:])
        return path

    def _lifts(self, roots: Array) -> Array:
        """How far (n,) each root (n, 7 + j) is below its preferred height, smoothed; 0 at ends."""
        rotations = np.array([pin.Quaternion(root[3:7]).matrix() for root in roots])
        feet = self._feet @ np.swapaxes(rotations, 1, 2) + roots[:, None, :3]
        heights = self._heights(feet.reshape(-1, 3), np.repeat(roots[:, 2], len(self._feet)))
        gaps = (heights - feet.reshape(-1, 3)[:, 2]).reshape(len(roots), -1)
        found = np.isfinite(gaps)
        lifts = np.where(found, gaps, 0.0).sum(axis=1) / np.maximum(found.sum(axis=1), 1)
        padded = np.pad(lifts, SMOOTHING, mode="edge")
        window = np.ones(2 * SMOOTHING + 1) / (2 * SMOOTHING + 1)
        lifts = np.convolve(padded, window, mode="valid")
        lifts[[0, -1]] = 0.0
        return np.asarray(lifts)

    def _heights(self, feet: Array, ceilings: Array) -> Array:
        """Height (n,) of the highest support surface in the plumb line of each foot (n, 3).

        Surfaces above the foot's own root (n,) do not count; NaN where there is none.
        """
        pieces = self._pieces
        best = np.full(len(feet), -np.inf)
        x, y = feet[:, 0], feet[:, 1]
        for k in range(len(pieces.surface)):
            over = (
                (x >= pieces.low[k, 0]) & (x <= pieces.high[k, 0])
                & (y >= pieces.low[k, 1]) & (y <= pieces.high[k, 1])
            )  # fmt: skip
            index = np.flatnonzero(over)
            if len(index) == 0:
                continue
            n = pieces.normals[k]
            z = (pieces.offsets[k] - n[0] * x[index] - n[1] * y[index]) / n[2]
            points = np.column_stack([x[index], y[index], z])
            inside = (points @ pieces.edge_normals[k].T >= pieces.edge_offsets[k]).all(axis=1)
            index, z = index[inside], z[inside]
            z = np.where(z < ceilings[index], z, -np.inf)
            best[index] = np.maximum(best[index], z)
        return np.where(np.isfinite(best), best, np.nan)
