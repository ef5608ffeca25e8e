"""The root placements that lie ahead on the guide, for ranking contacts by how long they last."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LookAhead:
    """Roots ahead and the direction of motion.

    Attributes:
        root: (7 + j,) the root configuration now.
        roots: (h, 7 + j) those that follow, nearest first; h may be 0.
        direction: (3,) unit direction of the root's motion in the world; zero where it rests.
    """

    root: Array
    roots: Array
    direction: Array

    @staticmethod
    def still(root: Array) -> LookAhead:
        """Nothing ahead: the root rests."""
        return LookAhead(root, np.zeros((0, len(root))), np.zeros(3))

    @property
    def middle(self) -> Array:
        """The root configuration in the middle of the way ahead."""
        return np.asarray(self.roots[len(self.roots) // 2] if len(self.roots) else self.root)
