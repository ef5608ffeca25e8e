"""The root placements that lie ahead on the guide, for ranking contacts by how long they last."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbprm_core.guide.protocol import Guide

Array = NDArray[np.float64]

COUNT = 8  # roots ahead
MIN_MOTION = 1e-6  # metres; a shorter motion between two roots has no direction


@dataclass(frozen=True, eq=False)
class LookAhead:
    """Root configurations ahead on the guide, and the direction of motion.

    Attributes:
        root: (7 + j,) present root configuration.
        roots: (h, 7 + j) root configurations ahead, nearest first; h may be 0.
        direction: (3,) unit direction of the root's motion in the planning frame; zero where the
            root rests or only rotates.
    """

    root: Array
    roots: Array
    direction: Array

    @staticmethod
    def still(root: Array) -> LookAhead:
        """The view of a root that rests.

        Args:
            root: (7 + j,) root configuration.
        """
        return LookAhead(root, np.zeros((0, len(root))), np.zeros(3))

    @staticmethod
    def along(guide: Guide, s: float, span: float, step: float) -> LookAhead:
        """The view from an arc length on a guide.

        The direction is that of two consecutive root positions (Tonneau et al. 2018, section
        5.2.2): from the present root to the next one, and near the goal from the last but one to
        the goal.

        Args:
            guide: the guide.
            s: arc length, metres.
            span: length of the guide ahead, metres.
            step: distance of consecutive roots, metres.
        """
        ahead = s + span * np.arange(1, COUNT + 1) / COUNT
        first = max(0.0, min(s, guide.length - step))
        found = guide.roots(np.concatenate([ahead, [first, first + step, s]]))
        roots, motion, root = found[:COUNT], found[-2, :3] - found[-3, :3], found[-1]
        length = float(np.linalg.norm(motion))
        direction = motion / length if length > MIN_MOTION else np.zeros(3)
        return LookAhead(root, roots, direction)

    @property
    def middle(self) -> Array:
        """Root configuration (7 + j,) in the middle of the guide ahead; the present one at rest."""
        return np.asarray(self.roots[len(self.roots) // 2] if len(self.roots) else self.root)
