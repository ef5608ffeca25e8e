"""The trunk W0_s against the scene: at a root configuration, and all along an edge."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import coal
import numpy as np
from numpy.typing import NDArray

from rbprm_core.guide.root.placements import RootPlacements
from rbprm_core.guide.root_space import StraightWay
from rbprm_core.robot.bodies import convex
from rbprm_core.robot.model import ROOT_JOINT, Robot
from rbprm_core.robot.volumes import TrunkPiece

Array = NDArray[np.float64]

CLEARANCE = 1e-3  # metres; an edge on which a piece comes nearer than this may be refused


class TrunkTest:
    """Collision of the trunk's convex pieces with a mesh. Not thread-safe: it holds scratch data.

    Args:
        pieces: of W0_s. mesh: what they must not touch.
    """

    def __init__(self, robot: Robot, pieces: Sequence[TrunkPiece], mesh: coal.BVHModelBase) -> None:
        self._placements = RootPlacements(robot, [piece.joint for piece in pieces])
        self._pieces = [convex(piece.corners) for piece in pieces]
        self._levers = np.array([levers(robot, piece.joint, piece.corners) for piece in pieces])
        self._mesh, self._still = mesh, coal.Transform3s()
        self._request, self._result = coal.CollisionRequest(), coal.CollisionResult()

    @property
    def radius(self) -> float:
        """Metres from the root's origin within which all pieces stay."""
        return float(max((row[0] for row in self._levers), default=0.0))

    def hits(self, root: Array) -> bool:
        """True where a piece touches the mesh at a root configuration (7 + j,)."""
        placements = self._placements.at(root)
        return any(self._near(k, placement, 0.0) for k, placement in enumerate(placements))

    def sweep_hits(self, way: StraightWay) -> bool:
        """True where a piece touches the mesh anywhere on a way, or comes near to it.

        Conservative advancement by halves. No point of a piece moves farther, on half a stretch of
        the way, than the root does, plus the angle it turns times the piece's distance from the
        root, plus what each joint of the root turns times the distance from that joint: where the
        piece has that much room in the middle of a stretch, the whole stretch is free. Where it has
        not, both halves are asked, down to a room of CLEARANCE.
        """
        if not self._pieces:
            return False
        ways = way.moved + self._levers @ np.concatenate([[way.turned], way.joints_turned])
        stretches = deque([(0.5, 0.5, list(range(len(self._pieces))))])  # middle, half, pieces
        while stretches:  # wide stretches first: what fails mostly fails near the middle
            middle, half, pieces = stretches.popleft()
            placements = self._placements.at(way.at(middle))
            close = [k for k in pieces if self._near(k, placements[k], half * ways[k])]
            if any(half * ways[k] <= CLEARANCE or self._near(k, placements[k], 0) for k in close):
                return True
            if close:
                stretches += [(middle + side * half / 2, half / 2, close) for side in (-1, 1)]
        return False

    def _near(self, piece: int, placement: coal.Transform3s, room: float) -> bool:
        """True where a piece is no farther than some room from the mesh, metres."""
        self._request.security_margin = room
        self._result.clear()
        coal.collide(
            self._pieces[piece], placement, self._mesh, self._still, self._request, self._result
        )
        return bool(self._result.isCollision())


def levers(robot: Robot, joint: int, corners: Array) -> Array:
    """What bounds the motion of a body (1 + j,): metres a radian of the root, and of its joints.

    The first is the largest distance of the body from the root's origin. A joint that slides
    counts 1 instead, metres a metre.

    Args:
        joint: id of the joint that carries the body. corners: (n, 3) of it in that joint's frame.
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
