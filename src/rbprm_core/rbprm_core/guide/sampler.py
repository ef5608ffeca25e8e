"""Samples of the root near surfaces, where contact is possible (section 3.3)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.guide.reachability import Reachability
from rbprm_core.guide.space import RootSpace
from rbprm_core.scene import Scene

Array = NDArray[np.float64]

AREA_WEIGHTED = 0.3  # share of samples whose surface is drawn by area, not evenly
HEIGHTS = (0.6, 1.15)  # range of the root's height over its surface, in reference heights
TRIES = 50


class RootSampler:
    """Draws roots over a random point of a random surface, inside the bounds and reachable.

    Args:
        height: of the root over its contacts in the reference posture, metres.
    """

    def __init__(
        self, space: RootSpace, scene: Scene, reachability: Reachability, height: float
    ) -> None:
        self._space, self._reachability, self._height = space, reachability, height
        surfaces = [s for s in scene.surfaces if s.kind == "support"]
        fans = [
            (piece[0], piece[i], piece[i + 1], s.normal)
            for s in surfaces
            for piece in s.polygon.pieces
            for i in range(1, len(piece) - 1)
        ]
        self._triangles = np.array([f[:3] for f in fans]).reshape(-1, 3, 3)
        self._normals = np.array([f[3] for f in fans]).reshape(-1, 3)
        sides = self._triangles[:, 1:] - self._triangles[:, :1]
        areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        self._cumulative = np.cumsum(areas / areas.sum()) if len(areas) else areas

    def draw(self, rng: np.random.Generator) -> Array | None:
        """A reachable root configuration, or None where some tries gave none."""
        for _ in range(TRIES):
            root = self._candidate(rng)
            if self._space.contains(root) and self._reachability.holds(root):
                return root
        return None

    def _candidate(self, rng: np.random.Generator) -> Array:
        bounds = self._space.bounds
        yaw, pitch, roll = rng.uniform(-bounds.half_ranges, bounds.half_ranges)
        rotation = pin.rpy.rpyToMatrix(roll, pitch, yaw)
        joints = rng.uniform(self._space.joint_low, self._space.joint_high)
        if len(self._triangles) == 0:
            position = rng.uniform(bounds.low, bounds.high)
        else:
            position = self._above_surface(rng)
        return np.concatenate([position, pin.Quaternion(rotation).coeffs(), joints])

    def _above_surface(self, rng: np.random.Generator) -> Array:
        if rng.random() < AREA_WEIGHTED:
            i = int(np.searchsorted(self._cumulative, rng.random()))
        else:
            i = int(rng.integers(len(self._triangles)))
        a, b, c = self._triangles[min(i, len(self._triangles) - 1)]
        u, v = rng.random(2)
        if u + v > 1:
            u, v = 1 - u, 1 - v
        height = self._height * rng.uniform(*HEIGHTS)
        return np.asarray(a + u * (b - a) + v * (c - a) + height * self._normals[i])
