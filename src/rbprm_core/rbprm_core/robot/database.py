"""The limb sample database: valid configurations indexed by where they put the effector (4.1)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CELL = 0.12  # metres; edge of a cell: larger ones hold more samples to test, smaller ones are more


class LimbDatabase:
    """Samples of a limb sorted by the cell of a regular grid that holds their effector.

    A grid does the octree's work in two NumPy passes: cells near a surface, then their samples.

    Args:
        joints: (m, n) valid configurations. positions: (m, 3) effector centres in the base frame.
        rotations: (m, 3, 3) of the contact frame. jacobians: (m, 3, n) of the centres
            (equation 10).

    Attributes:
        joints: (m, n). positions: (m, 3), rotations: (m, 3, 3) in the base frame.
        grams: (m, 3, 3) J J^T. manipulability: (m,) (equation 17).
    """

    def __init__(self, joints: Array, positions: Array, rotations: Array, jacobians: Array) -> None:
        cell = np.floor(positions / CELL).astype(np.int64)
        order = np.lexsort(cell.T)
        self.joints = joints[order]
        self.positions = positions[order]
        self.rotations = rotations[order]
        jacobians = jacobians[order]
        self.grams = jacobians @ np.swapaxes(jacobians, 1, 2)
        self.manipulability = np.sqrt(np.maximum(np.linalg.det(self.grams), 0.0))
        cells, self._starts, self._counts = np.unique(
            cell[order][:, ::-1], axis=0, return_index=True, return_counts=True
        )
        # lexsort sorts by the last key first: unique's order on the reversed columns is the same.
        self._centers: Array = np.asarray((cells[:, ::-1] + 0.5) * CELL, dtype=float)
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        self._box = low + np.indices((2, 2, 2)).reshape(3, -1).T * (high - low)

    def box(self, rotation: Array, translation: Array) -> tuple[Array, Array]:
        """Least and greatest corner (3,) in the world of the box around all effector positions.

        Args:
            rotation: (3, 3), translation: (3,) of the limb's base in the world.
        """
        corners = self._box @ rotation.T + translation
        return corners.min(axis=0), corners.max(axis=0)

    def near(
        self, normals: Array, offsets: Array, edge_normals: Array, edge_offsets: Array, band: float
    ) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Samples whose effector is near a convex planar piece, over it.

        Args:
            normals: (p, 3), offsets: (p,) of the pieces' planes in the base frame.
            edge_normals: (p, e, 3) inward, edge_offsets: (p, e).
            band: most metres from the plane on either side.

        Returns:
            Indices of samples (h,) and of the pieces (h,) they are near to.
        """
        half = CELL * math.sqrt(3) / 2
        height = self._centers @ normals.T - offsets
        cell, piece = np.nonzero(np.abs(height) <= band + half)
        inside = _inside(self._centers[cell], edge_normals[piece], edge_offsets[piece] - half)
        cell, piece = cell[inside], piece[inside]
        counts = self._counts[cell]
        piece = np.repeat(piece, counts)
        first = np.repeat(self._starts[cell] - np.cumsum(counts) + counts, counts)
        sample = first + np.arange(len(piece))
        points = self.positions[sample]
        height = np.einsum("ij,ij->i", points, normals[piece]) - offsets[piece]
        hit = np.abs(height) <= band
        sample, piece = sample[hit], piece[hit]
        inside = _inside(points[hit], edge_normals[piece], edge_offsets[piece])
        return sample[inside], piece[inside]


def _inside(points: Array, edge_normals: Array, edge_offsets: Array) -> NDArray[np.bool_]:
    """(h,) True where point i (h, 3) is inside all edges of its piece (h, e, 3), (h, e)."""
    x, y, z = points[:, :1], points[:, 1:2], points[:, 2:]
    height = edge_normals[..., 0] * x + edge_normals[..., 1] * y + edge_normals[..., 2] * z
    return np.asarray((height >= edge_offsets).all(axis=1))
