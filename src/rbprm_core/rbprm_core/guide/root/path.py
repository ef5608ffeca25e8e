"""A guide path: root configurations joined by straight interpolation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rbprm_core.guide.root_space import StraightWay, distance

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

    def root(self, s: float) -> Array:
        """Root configuration (7 + j,) at arc length s in metres; the ends are exact."""
        return self.at(s)

    def roots(self, s: Array) -> Array:
        """Root configurations (n, 7 + j) at arc lengths s (n,) in metres; see `root`."""
        return self.at_all(s)

    def posture(self, s: float) -> Array | None:
        """None: the path holds root configurations only."""
        return None

    def at(self, mark: float) -> Array:
        """The root configuration (7 + j,) at a distance along the path; the ends are exact."""
        if mark <= 0:
            return np.asarray(self.nodes[0].copy())
        if mark >= self.length:
            return np.asarray(self.nodes[-1].copy())
        i = int(np.searchsorted(self.marks, mark, side="right")) - 1
        span = self.marks[i + 1] - self.marks[i]
        return StraightWay(self.nodes[i], self.nodes[i + 1]).at((mark - self.marks[i]) / span)

    def at_all(self, marks: Array) -> Array:
        """The root configurations (n, 7 + j) at distances (n,) along the path; see `at`."""
        if self.length == 0:
            return np.repeat(self.nodes[:1], len(marks), axis=0)
        i = np.searchsorted(self.marks[1:-1], marks, side="right")
        spans = np.maximum(self.marks[i + 1] - self.marks[i], np.finfo(float).tiny)
        t = np.clip((marks - self.marks[i]) / spans, 0.0, 1.0)[:, None]
        first, last, angle = self.nodes[i], self.nodes[i + 1], self._angles[i, None]
        roots = first + t * (last - first)
        # sin(t a) / sin(a) with a scale that cancels: for no angle, t itself
        back, on = np.sinc((1 - t) * angle / np.pi) * (1 - t), np.sinc(t * angle / np.pi) * t
        mixed = back * first[:, 3:7] + on * self._signs[i, None] * last[:, 3:7]
        roots[:, 3:7] = mixed / np.linalg.norm(mixed, axis=1)[:, None]
        roots[marks <= 0] = self.nodes[0]
        roots[marks >= self.length] = self.nodes[-1]
        return np.asarray(roots)

    @cached_property
    def _signs(self) -> Array:
        """(n - 1,) -1 where the quaternion at an edge's end means the same turn the long way."""
        cosines = (self.nodes[:-1, 3:7] * self.nodes[1:, 3:7]).sum(axis=1)
        return np.where(cosines < 0, -1.0, 1.0)

    @cached_property
    def _angles(self) -> Array:
        """(n - 1,) angle in four dimensions between the quaternions at each edge's ends."""
        gaps = self.nodes[:-1, 3:7] - self._signs[:, None] * self.nodes[1:, 3:7]
        return np.asarray(2 * np.arcsin(np.minimum(np.linalg.norm(gaps, axis=1) / 2, 1.0)))
