"""Guide path: root configurations joined by straight segments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.guide.root_space import RootSegment, distance


@dataclass(frozen=True, eq=False)
class GuidePath:
    """Guide that consists of root configurations and the segments between them.

    Attributes:
        nodes: (n, 7 + j) root configurations; a single one where start and goal are the same.
    """

    nodes: Array

    @cached_property
    def arc_lengths(self) -> Array:
        """Arc length (n,) at each node, m (rotations count as in `distance`)."""
        steps = [float(distance(a, b)) for a, b in zip(self.nodes, self.nodes[1:], strict=False)]
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Length of the path, m."""
        return float(self.arc_lengths[-1])

    def root(self, s: float) -> Array:
        """Root configuration (7 + j,) at an arc length; both ends are exact.

        Args:
            s: arc length, m; clamped to the path.
        """
        if s <= 0:
            return np.asarray(self.nodes[0].copy())
        if s >= self.length:
            return np.asarray(self.nodes[-1].copy())
        i = int(np.searchsorted(self.arc_lengths, s, side="right")) - 1
        span = self.arc_lengths[i + 1] - self.arc_lengths[i]
        return RootSegment(self.nodes[i], self.nodes[i + 1]).at((s - self.arc_lengths[i]) / span)

    def roots(self, s: Array) -> Array:
        """Root configurations (n, 7 + j) at arc lengths; see `root`.

        Args:
            s: (n,) arc lengths, m; clamped to the path.
        """
        if self.length == 0:
            return np.repeat(self.nodes[:1], len(s), axis=0)
        i = np.searchsorted(self.arc_lengths[1:-1], s, side="right")
        spans = np.maximum(self.arc_lengths[i + 1] - self.arc_lengths[i], np.finfo(float).tiny)
        t = np.clip((s - self.arc_lengths[i]) / spans, 0.0, 1.0)[:, None]
        first, last, angle = self.nodes[i], self.nodes[i + 1], self._angles[i, None]
        roots = first + t * (last - first)
        # Spherical interpolation. sin(t a) / sin(a), but for a common factor that the
        # normalisation removes, so that the weights become 1 - t and t where the angle is 0.
        back, on = np.sinc((1 - t) * angle / np.pi) * (1 - t), np.sinc(t * angle / np.pi) * t
        mixed = back * first[:, 3:7] + on * self._signs[i, None] * last[:, 3:7]
        roots[:, 3:7] = mixed / np.linalg.norm(mixed, axis=1)[:, None]
        roots[s <= 0] = self.nodes[0]
        roots[s >= self.length] = self.nodes[-1]
        return np.asarray(roots)

    def posture(self, s: float) -> Array | None:
        """None: the path holds root configurations only.

        Args:
            s: arc length, m.
        """
        return None

    @cached_property
    def _signs(self) -> Array:
        """(n - 1,) -1 for segments between quaternions of opposite sign, 1 for others."""
        cosines = (self.nodes[:-1, 3:7] * self.nodes[1:, 3:7]).sum(axis=1)
        return np.where(cosines < 0, -1.0, 1.0)

    @cached_property
    def _angles(self) -> Array:
        """Angle (n - 1,) between the quaternions at the ends of each segment, in 4D, rad."""
        gaps = self.nodes[:-1, 3:7] - self._signs[:, None] * self.nodes[1:, 3:7]
        return np.asarray(2 * np.arcsin(np.minimum(np.linalg.norm(gaps, axis=1) / 2, 1.0)))
