"""Settling of a guide: moves its roots to where the reference posture suits the terrain below.

This step is not in Tonneau et al. 2018. The reachability condition accepts a root at any height
within the limbs' reach, and shortcuts cut straight through these heights. A root at the reference
posture's height leaves the contact planner far more candidates than one that crouches over a block.
The condition also accepts a root far to the side of a narrow support, where contacts exist and
static equilibrium does not; over the middle of the support, both do.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.ndimage import minimum_filter1d

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.terrain import Terrain
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.limb import Limb
from rbprm_core.scene import Scene
from rbprm_core.stages import Stage

SPACING = 0.1  # m between the roots that are moved
SMOOTHING = 3  # number of roots on either side over which moves are averaged
CENTRING = 4  # number of successive moves to the side; three reach the middle of a beam
TRAILING = 2  # number of roots on either side among which a stance foot may stay behind
STRETCH = 0.96  # share of a limb's downward reach; a fully stretched limb cannot move
PASSES = 6  # number of times that invalid moves are halved; the last pass sets them to zero


class Settler:
    """Settles guides of one robot in one scene.

    Args:
        data: robot with its limb workspaces.
        scene: scene with the supporting surfaces.
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
        self._terrain = Terrain(scene, reach=data.height)
        self._stretch = STRETCH * min((_depth(data, limb, scratch) for limb in limbs), default=0.0)

    def settle(self, path: GuidePath, edges: EdgeTest, budget: Budget) -> GuidePath:
        """Path with its inner roots moved towards their preferred positions, as far as it is valid.

        Moves that break the validity of an edge are halved, and set to zero in the last pass. The
        path itself where it is short, where no limb is required, or where roots stay invalid.

        Args:
            path: valid path.
            edges: test of edges.
            budget: checked before each test, in stage "shortcut".

        Raises:
            TimeLimitReached: raised by the budget.
            Cancelled: raised by the budget.
        """
        if len(self._feet) == 0 or path.length < 2 * SPACING:
            return path
        count = int(np.ceil(path.length / SPACING))
        roots = path.roots(np.linspace(0, path.length, count + 1))
        moves = self._moves(roots)
        valid = np.zeros(count, dtype=bool)
        for i in range(PASSES):
            settled = roots.copy()
            settled[:, :3] += moves
            for k in np.flatnonzero(~valid):
                budget.check(Stage.SHORTCUT, i / PASSES)
                valid[k] = edges.holds(settled[k], settled[k + 1])
            if valid.all():
                return GuidePath(settled)
            reduced = np.zeros(count + 1, dtype=bool)
            reduced[:-1] |= ~valid
            reduced[1:] |= ~valid
            moves[reduced] *= 0.5 if i < PASSES - 2 else 0.0
            moved = reduced & (np.abs(moves) > 0).any(axis=1)
            valid &= ~(reduced[:-1] | reduced[1:] | moved[:-1] | moved[1:])
        return path

    def _moves(self, roots: Array) -> Array:
        """Moves (n, 3) of roots (n, 7 + j) to their preferred positions, m; zero at the ends."""
        moves = np.zeros((len(roots), 3))
        for _ in range(CENTRING):
            sideways, lifts = self._step(roots, moves)
            if not sideways.any():
                break
            moves[:, :2] += sideways
        moves[:, 2] = lifts
        return moves

    def _step(self, roots: Array, moves: Array) -> tuple[Array, Array]:
        """Next sideways moves (n, 2) and vertical moves (n,) of roots, m.

        Sideways: the mean of the feet's horizontal offsets to the nearest surface, without the
        component along the path, which would only change the spacing of the roots. Vertical: the
        mean height of the terrain relative to the feet, limited by how far a stance foot reaches
        down that stays behind on the lowest terrain nearby.

        Args:
            roots: (n, 7 + j) root configurations.
            moves: (n, 3) moves so far, m; the vertical ones are ignored.
        """
        rotations = np.array([pin.Quaternion(root[3:7]).matrix() for root in roots])
        places = roots[:, :3] + moves * [1, 1, 0]
        feet = (self._feet @ np.swapaxes(rotations, 1, 2) + places[:, None]).reshape(-1, 3)
        ceilings = np.repeat(places[:, 2], len(self._feet))
        heights = self._terrain.heights(feet, ceilings).reshape(len(roots), -1)
        gaps = heights - feet[:, 2].reshape(len(roots), -1)
        found = np.isfinite(gaps)
        lifts = np.where(found, gaps, 0.0).sum(axis=1) / np.maximum(found.sum(axis=1), 1)
        lowest = minimum_filter1d(np.where(found, heights, np.inf).min(axis=1), 2 * TRAILING + 1)
        limit = lowest + self._stretch - places[:, 2]
        sideways = np.zeros((len(feet), 2))
        unsupported = ~found.ravel()
        sideways[unsupported] = self._terrain.offsets(feet[unsupported], ceilings[unsupported])
        sideways = sideways.reshape(len(roots), -1, 2).mean(axis=1)
        along = np.gradient(places[:, :2], axis=0)
        along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
        sideways -= (sideways * along).sum(axis=1)[:, None] * along
        lifts = np.minimum(_smooth(lifts[:, None])[:, 0], limit)
        return _smooth(sideways), _smooth(lifts[:, None])[:, 0]


def _depth(data: RobotData, limb: Limb, scratch: pin.Data) -> float:
    """Distance by which a limb's workspace reaches below the root in the reference posture, m."""
    corners = data.workspaces[data.robot.limbs.index(limb)]
    base = scratch.oMi[limb.base]
    return float(-(corners @ base.rotation.T + base.translation)[:, 2].min()) + limb.radius


def _smooth(values: Array) -> Array:
    """Values (n, k) averaged over their neighbours, and zero at the ends."""
    padded = np.pad(values, ((SMOOTHING, SMOOTHING), (0, 0)), mode="edge")
    window = np.ones(2 * SMOOTHING + 1) / (2 * SMOOTHING + 1)
    smooth = np.array([np.convolve(column, window, mode="valid") for column in padded.T]).T
    smooth[[0, -1]] = 0.0
    return smooth
