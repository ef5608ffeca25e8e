"""Collision of the scaled trunk $W_0^s$ with the scene, at a root configuration and along an edge.

Tonneau et al. 2018, section 3.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import coal
import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.guide.root.root_kinematics import RootKinematics
from rbprm_core.guide.root_space import RootSegment
from rbprm_core.robot.bodies import convex
from rbprm_core.robot.model import ROOT_JOINT, Robot
from rbprm_core.robot.volumes import TrunkPiece

CLEARANCE = 1e-3  # m; an edge on which a piece comes nearer than this may be refused


class TrunkTest:
    """Collision of the trunk's convex pieces with a mesh.

    Not thread-safe: it holds scratch data.

    Args:
        robot: robot model.
        pieces: convex pieces of the scaled trunk.
        mesh: mesh in the planning frame that the pieces must not touch.
    """

    def __init__(self, robot: Robot, pieces: Sequence[TrunkPiece], mesh: coal.BVHModelBase) -> None:
        self._kinematics = RootKinematics(robot, [piece.joint for piece in pieces])
        self._pieces = [convex(piece.corners) for piece in pieces]
        self._levers = np.array([lever_arms(robot, piece.joint, piece.corners) for piece in pieces])
        self._mesh, self._still = mesh, coal.Transform3s()
        self._request, self._result = coal.CollisionRequest(), coal.CollisionResult()

    @property
    def radius(self) -> float:
        """Distance from the root's origin within which all pieces stay, m."""
        return float(max((row[0] for row in self._levers), default=0.0))

    def hits(self, root: Array) -> bool:
        """True where a piece touches the mesh at a root configuration.

        Args:
            root: (7 + j,) root configuration.
        """
        placements = self._kinematics.placements(root)
        return any(self._near(k, placement, 0.0) for k, placement in enumerate(placements))

    def sweep_hits(self, edge: RootSegment) -> bool:
        r"""True where a piece touches the mesh anywhere on an edge, or comes within `CLEARANCE`.

        Conservative advancement by bisection. On an interval of half width $h$ (as a share of the
        edge) no point of a piece is farther than $h d$ from where it is in the middle, with
        $d = \Delta p + r_0 \, \Delta\alpha + \sum_i r_i \, |\Delta q_i|$, the edge's translation
        $\Delta p$, rotation angle $\Delta\alpha$ and joint motions $\Delta q_i$, and the piece's
        lever arms $r$ (`lever_arms`). A piece farther than $h d$ from the mesh in the middle is
        free on the whole interval. Otherwise both halves are tested, until $h d$ falls below
        `CLEARANCE`.

        Args:
            edge: edge between two root configurations.
        """
        if not self._pieces:
            return False
        rotations = np.concatenate([[edge.turned], edge.joint_motion])
        bounds = edge.moved + self._levers @ rotations
        # Middle and half width of an interval, and the pieces that may touch the mesh on it. Wide
        # intervals come first: an edge that fails mostly fails near its middle.
        intervals = deque([(0.5, 0.5, list(range(len(self._pieces))))])
        while intervals:
            middle, half, pieces = intervals.popleft()
            placements = self._kinematics.placements(edge.at(middle))
            close = [k for k in pieces if self._near(k, placements[k], half * bounds[k])]
            if any(half * bounds[k] <= CLEARANCE or self._near(k, placements[k], 0) for k in close):
                return True
            if close:
                intervals += [(middle + side * half / 2, half / 2, close) for side in (-1, 1)]
        return False

    def _near(self, piece: int, placement: coal.Transform3s, margin: float) -> bool:
        """True where the distance of a piece from the mesh is at most a margin in metres."""
        self._request.security_margin = margin
        self._result.clear()
        coal.collide(
            self._pieces[piece], placement, self._mesh, self._still, self._request, self._result
        )
        return bool(self._result.isCollision())


def lever_arms(robot: Robot, joint: int, corners: Array) -> Array:
    """Lever arms (1 + j,) of a body: bounds of its motion per radian of the root and of its joints.

    The first is the largest distance of the body from the root's origin, m. Each other is the
    largest distance of the body from a joint that is planned with the root, m, or 1 for a joint
    that slides, or 0 for a joint that does not move the body.

    Args:
        robot: robot model.
        joint: id of the joint to which the body belongs.
        corners: (n, 3) corners of the body in that joint's frame, m.
    """
    model, moving = robot.model, list(robot.root_index)
    found = np.zeros(1 + len(moving) - 7)
    reach = float(np.linalg.norm(corners, axis=1).max())
    while joint != ROOT_JOINT:
        place = model.joints[joint].idx_q
        slides = model.joints[joint].shortname().startswith("JointModelP")
        if place in moving:
            found[1 + moving.index(place) - 7] = 1.0 if slides else reach
        reach += float(np.linalg.norm(model.jointPlacements[joint].translation))
        reach += max(abs(robot.low[place]), abs(robot.high[place])) if slides else 0.0
        joint = model.parents[joint]
    found[0] = reach
    return found
