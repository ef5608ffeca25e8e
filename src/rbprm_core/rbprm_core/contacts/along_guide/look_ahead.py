"""The root placements that lie ahead on the guide, for ranking contacts by how long they last."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbprm_core.guide.root.path import GuidePath

Array = NDArray[np.float64]

COUNT = 8  # of roots that are looked at
STILL = 1e-6  # metres; a shorter motion between two roots has no direction


@dataclass(frozen=True, eq=False)
class LookAhead:
    """Roots ahead and the direction of motion.

    Attributes:
        root: (7 + j,) the root configuration now.
        roots: (h, 7 + j) those that follow, nearest first; h may be 0.
        direction: (3,) unit local direction of the root's motion in the world; zero where it
            rests or only turns.
    """

    root: Array
    roots: Array
    direction: Array

    @staticmethod
    def still(root: Array) -> LookAhead:
        """Nothing ahead: the root rests."""
        return LookAhead(root, np.zeros((0, len(root))), np.zeros(3))

    @staticmethod
    def along(guide: GuidePath, mark: float, span: float, step: float) -> LookAhead:
        """What lies ahead of a place on a guide.

        The direction is that of two consecutive root positions (section 5.2.2): from the root now
        to the next one, and near the goal from the last but one to the goal.

        Args:
            mark: the place, metres along the guide. span: how far to look ahead, metres.
            step: distance of consecutive roots, metres.
        """
        marks = mark + span * np.arange(1, COUNT + 1) / COUNT
        first = max(0.0, min(mark, guide.length - step))
        found = guide.at_all(np.concatenate([marks, [first, first + step, mark]]))
        roots, motion, root = found[:COUNT], found[-2, :3] - found[-3, :3], found[-1]
        length = float(np.linalg.norm(motion))
        direction = motion / length if length > STILL else np.zeros(3)
        return LookAhead(root, roots, direction)

    @property
    def middle(self) -> Array:
        """The root configuration in the middle of the way ahead."""
        return np.asarray(self.roots[len(self.roots) // 2] if len(self.roots) else self.root)
