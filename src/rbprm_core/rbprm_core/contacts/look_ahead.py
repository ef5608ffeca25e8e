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
        roots: (h, 7 + j) root configurations, nearest first; h may be 0.
        direction: (3,) unit direction of the root's motion in the world; zero where it rests.
    """

    roots: Array
    direction: Array

    @staticmethod
    def still(root_size: int) -> LookAhead:
        """Nothing ahead: the root rests."""
        return LookAhead(np.zeros((0, root_size)), np.zeros(3))
