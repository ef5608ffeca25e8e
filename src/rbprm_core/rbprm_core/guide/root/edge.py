"""The test of a straight edge between two root configurations: bounds and reachability."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbprm_core.guide.root.reachability import Reachability
from rbprm_core.guide.root_space import RootSpace, StraightWay

Array = NDArray[np.float64]


class EdgeTest:
    """What decides whether a guide may go straight from one root configuration to another.

    The bounds and the clearance of the trunk are kept at every point of an edge that holds; that
    the limbs reach surfaces is tested at points `resolution` apart.

    Args:
        resolution: metres (rotations count as in `distance`).
    """

    def __init__(self, space: RootSpace, reachability: Reachability, resolution: float) -> None:
        self.space, self.reachability = space, reachability
        self._resolution = resolution

    def holds(self, a: Array, b: Array) -> bool:
        """True where bounds and reachability hold from a (known to hold) to b."""
        # Bounds last: hardly an edge between two roots that keep them breaks them.
        way = StraightWay(a, b)
        return self.reachability.edge_holds(way, self._steps(way)) and self.space.contains_edge(
            a, b
        )

    def avoids(self, a: Array, b: Array) -> bool:
        """True where the edge passes a root that the condition has been told to avoid."""
        way = StraightWay(a, b)
        steps = self._steps(way)
        return self.reachability.avoids(way.at_all(np.arange(steps + 1) / steps))

    def _steps(self, way: StraightWay) -> int:
        return max(1, math.ceil(way.length / self._resolution))
