"""Validity of a straight edge between two root configurations: bounds and reachability."""

from __future__ import annotations

import math

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.guide.root.reachability import Reachability
from rbprm_core.guide.root_space import RootSegment, RootSpace


class EdgeTest:
    """Test of edges: whether a guide may go straight from one root configuration to another.

    On a valid edge, every point keeps the bounds and has a trunk free of collision. Whether the
    limbs reach surfaces is tested at points a resolution apart.

    Args:
        space: bounds of the root.
        reachability: reachability condition in the scene.
        resolution: distance between tested points, m (rotations count as in `distance`).
    """

    def __init__(self, space: RootSpace, reachability: Reachability, resolution: float) -> None:
        self.space, self.reachability = space, reachability
        self._resolution = resolution

    def holds(self, a: Array, b: Array) -> bool:
        """True where bounds and reachability hold on the edge from a to b.

        Args:
            a: (7 + j,) first root configuration, known to be valid.
            b: (7 + j,) last root configuration.
        """
        # Bounds last: an edge between two roots within the bounds seldom breaks them.
        edge = RootSegment(a, b)
        steps = self._steps(edge)
        return self.reachability.edge_holds(edge, steps) and self.space.contains_segment(a, b)

    def avoids(self, a: Array, b: Array) -> bool:
        """True where the edge passes near a root configuration that must be avoided.

        Args:
            a: (7 + j,) first root configuration.
            b: (7 + j,) last root configuration.
        """
        edge = RootSegment(a, b)
        steps = self._steps(edge)
        return self.reachability.avoids(edge.at_all(np.arange(steps + 1) / steps))

    def _steps(self, edge: RootSegment) -> int:
        return max(1, math.ceil(edge.length / self._resolution))
