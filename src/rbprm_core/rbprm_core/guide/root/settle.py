"""Settle a guide: let the root stand at its preferred place over the surfaces beneath it.

Not in the paper. The reachability condition accepts a root at any height within the limbs' reach,
and shortcuts cut straight through it; a root that rides at the reference posture's height leaves
the contact generator far more candidates than one that crouches over a block. The condition also
accepts a root that leans far out beside a narrow way, where feet are found and balance is not: a
root over the middle of what its feet can stand on has both.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from rbprm_core.budget import Budget
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.ground import Ground
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.limb import Limb
from rbprm_core.scene import Scene

Array = NDArray[np.float64]

SPACING = 0.1  # metres between the roots that are moved
SMOOTHING = 3  # roots on either side over which moves are averaged
CENTRING = 4  # moves aside, each from the last; the way to the middle of a beam takes three
STEP = 2  # roots on either side where a foot may be left behind
STRETCH = 0.96  # of a limb's reach downwards; a limb that is straight can go nowhere
PASSES = 6  # halvings of what does not hold, the last of which drops it


class Settler:
    """Preferred places for one robot in one scene.

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
        self._ground = Ground(scene, reach=data.height)
        self._stretch = STRETCH * min((_depth(data, limb, scratch) for limb in limbs), default=0.0)

    def settle(self, path: GuidePath, edges: EdgeTest, budget: Budget) -> GuidePath:
        """The path with its inner roots moved towards their preferred places, where that holds."""
        if len(self._feet) == 0 or path.length < 2 * SPACING:
            return path
        count = int(np.ceil(path.length / SPACING))
        roots = path.at_all(np.linspace(0, path.length, count + 1))
        moves = self._moves(roots)
        checked = np.zeros(count, dtype=bool)
        for i in range(PASSES):
            settled = roots.copy()
            settled[:, :3] += moves
            for k in np.flatnonzero(~checked):
                budget.check("shortcut", i / PASSES)
                checked[k] = edges.holds(settled[k], settled[k + 1])
            if checked.all():
                return GuidePath(settled)
            touched = np.zeros(count + 1, dtype=bool)
            touched[:-1] |= ~checked
            touched[1:] |= ~checked
            moves[touched] *= 0.5 if i < PASSES - 2 else 0.0
            moved = touched & (np.abs(moves) > 0).any(axis=1)
            checked &= ~(touched[:-1] | touched[1:] | moved[:-1] | moved[1:])
        return path

    def _moves(self, roots: Array) -> Array:
        """How far (n, 3) each root (n, 7 + j) is from its preferred place; 0 at the ends."""
        moves = np.zeros((len(roots), 3))
        for _ in range(CENTRING):
            aside, lifts = self._step(roots, moves)
            if not aside.any():
                break
            moves[:, :2] += aside
        moves[:, 2] = lifts
        return moves

    def _step(self, roots: Array, moves: Array) -> tuple[Array, Array]:
        """How far roots (n, 7 + j), moved (n, 3), still have to go aside (n, 2) and up (n,).

        Aside by the mean of the feet's ways to the nearest ground, less what goes along the path:
        that would only hurry or delay the root. Up by the mean height under the feet, but not
        farther than a foot can reach down that is left behind on the lowest ground near by.
        """
        rotations = np.array([pin.Quaternion(root[3:7]).matrix() for root in roots])
        places = roots[:, :3] + moves * [1, 1, 0]
        feet = (self._feet @ np.swapaxes(rotations, 1, 2) + places[:, None]).reshape(-1, 3)
        ceilings = np.repeat(places[:, 2], len(self._feet))
        heights = self._ground.heights(feet, ceilings).reshape(len(roots), -1)
        gaps = heights - feet[:, 2].reshape(len(roots), -1)
        found = np.isfinite(gaps)
        lifts = np.where(found, gaps, 0.0).sum(axis=1) / np.maximum(found.sum(axis=1), 1)
        lowest = minimum_filter1d(np.where(found, heights, np.inf).min(axis=1), 2 * STEP + 1)
        most = lowest + self._stretch - places[:, 2]
        aside = np.zeros((len(feet), 2))
        lost = ~found.ravel()
        aside[lost] = self._ground.ways_to(feet[lost], ceilings[lost])
        aside = aside.reshape(len(roots), -1, 2).mean(axis=1)
        along = np.gradient(places[:, :2], axis=0)
        along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
        aside -= (aside * along).sum(axis=1)[:, None] * along
        lifts = np.minimum(_smooth(lifts[:, None])[:, 0], most)
        return _smooth(aside), _smooth(lifts[:, None])[:, 0]


def _depth(data: RobotData, limb: Limb, scratch: pin.Data) -> float:
    """How far below the root a limb's workspace reaches in the reference posture, metres."""
    corners = data.workspaces[data.robot.limbs.index(limb)]
    base = scratch.oMi[limb.base]
    return float(-(corners @ base.rotation.T + base.translation)[:, 2].min()) + limb.radius


def _smooth(values: Array) -> Array:
    """Values (n, k) averaged over their neighbours; 0 at the ends."""
    padded = np.pad(values, ((SMOOTHING, SMOOTHING), (0, 0)), mode="edge")
    window = np.ones(2 * SMOOTHING + 1) / (2 * SMOOTHING + 1)
    smooth = np.array([np.convolve(column, window, mode="valid") for column in padded.T]).T
    smooth[[0, -1]] = 0.0
    return smooth
