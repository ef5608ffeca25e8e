"""The limb sample database: valid configurations indexed by where they put the effector (4.1)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CELL = 0.12  # metres; edge of a cell: larger ones hold more samples to test, smaller ones are more
MIN_CELLS = 6  # along the reach of a limb too small for cells of that edge, such as a finger


class LimbDatabase:
    """Samples of a limb sorted by the cell of a regular grid that holds their effector.

    A grid does the octree's work in two NumPy passes: cells near a surface, then their samples.

    Args:
        joints: (m, n) valid configurations. positions: (m, 3) effector centres in the base frame.
        rotations: (m, 3, 3) of the contact frame. jacobians: (m, 3, n) of the centres
            (equation 10). coms: (m, 3) centres of mass of the limb in the base frame.

    Attributes:
        joints: (m, n). positions, coms: (m, 3), rotations: (m, 3, 3) in the base frame.
        grams: (m, 3, 3) J J^T. manipulability: (m,) (equation 17).
    """

    def __init__(
        self, joints: Array, positions: Array, rotations: Array, jacobians: Array, coms: Array
    ) -> None:
        reach = float((positions.max(axis=0) - positions.min(axis=0)).max())
        self._cell = min(CELL, max(reach, 1e-3) / MIN_CELLS)
        cell = np.floor(positions / self._cell).astype(np.int64)
        order = np.lexsort(cell.T)
        self.joints = joints[order]
        self.positions = positions[order]
        self.rotations = rotations[order]
        self.coms = coms[order]
        self._columns = np.ascontiguousarray(self.positions.T)
        jacobians = jacobians[order]
        self.grams = jacobians @ np.swapaxes(jacobians, 1, 2)
        self.manipulability = np.sqrt(np.maximum(np.linalg.det(self.grams), 0.0))
        cells, self._starts, self._counts = np.unique(
            cell[order][:, ::-1], axis=0, return_index=True, return_counts=True
        )
        # lexsort sorts by the last key first: unique's order on the reversed columns is the same.
        self._centers: Array = np.asarray((cells[:, ::-1] + 0.5) * self._cell, dtype=float)
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
        half = self._cell * math.sqrt(3) / 2
        sides = [(edge_normals[:, k], edge_offsets[:, k]) for k in range(edge_offsets.shape[1])]
        close = np.abs(self._centers @ normals.T - offsets) <= band + half
        for normal, offset in sides:
            close &= self._centers @ normal.T >= offset - half
        cell, piece = np.nonzero(close)
        counts = self._counts[cell]
        piece = np.repeat(piece, counts)
        first = np.repeat(self._starts[cell] - np.cumsum(counts) + counts, counts)
        sample = first + np.arange(len(piece))
        hit = np.abs(_height(self._columns, sample, normals, offsets, piece)) <= band
        sample, piece = sample[hit], piece[hit]
        inside = np.ones(len(sample), dtype=bool)
        for normal, offset in sides:
            inside &= _height(self._columns, sample, normal, offset, piece) >= 0
        return sample[inside], piece[inside]


def _height(
    columns: Array,
    sample: NDArray[np.int_],
    normals: Array,
    offsets: Array,
    piece: NDArray[np.int_],
) -> Array:
    """Height (h,) of each sample's point, of columns (3, m), over the plane of its piece.

    Column by column: gathering rows of three numbers takes several times as long.
    """
    height = -offsets[piece]
    for column, normal in zip(columns, normals.T, strict=True):
        height += column[sample] * normal[piece]
    return height
