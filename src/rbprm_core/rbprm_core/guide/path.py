"""A guide path: root configurations joined by straight interpolation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rbprm_core.guide.space import distance, interpolate

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GuidePath:
    """The path of the root from start to goal.

    Attributes:
        nodes: (n, 7 + j) root configurations; one alone where start and goal are the same.
    """

    nodes: Array

    @cached_property
    def marks(self) -> Array:
        """(n,) distance along the path at each node, metres (rotations count as in `distance`)."""
        steps = [float(distance(a, b)) for a, b in zip(self.nodes, self.nodes[1:], strict=False)]
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Length in metres."""
        return float(self.marks[-1])

    def at(self, mark: float) -> Array:
        """The root configuration (7 + j,) at a distance along the path; the ends are exact."""
        if mark <= 0:
            return np.asarray(self.nodes[0].copy())
        if mark >= self.length:
            return np.asarray(self.nodes[-1].copy())
        i = int(np.searchsorted(self.marks, mark, side="right")) - 1
        span = self.marks[i + 1] - self.marks[i]
        return interpolate(self.nodes[i], self.nodes[i + 1], (mark - self.marks[i]) / span)
