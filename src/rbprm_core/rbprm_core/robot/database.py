"""The limb sample database: valid configurations of a limb, indexed by their effector's position.

It is the database of Tonneau et al. 2018, section 4.1, with a grid in place of the octree.
"""

from __future__ import annotations

import math

import numpy as np

from rbprm_core.arrays import Array, IntArray

CELL = 0.12  # metres; edge of a cell: larger cells hold more samples to test, smaller ones are more
MIN_CELLS = 6  # number along the reach of a limb too small for cells of that edge, such as a finger


class LimbDatabase:
    r"""Samples of a limb sorted by the cell of a regular grid that their effector lies in.

    The grid replaces the octree of Tonneau et al. 2018, section 4.1: two NumPy passes find the
    cells near a surface, then the samples in them.

    The limb's base frame is the frame of all positions. With $\dot{p} = J(q) \dot{q}$ the velocity
    of the contact frame's origin (Tonneau et al. 2018, equation 10), the manipulability of a sample
    is $h_w = \sqrt{\det(J J^T)}$ (Yoshikawa 1985; Tonneau et al. 2018,
    equation 17).

    Args:
        joints: (m, n) valid configurations of the limb, radians or metres.
        positions: (m, 3) origins of the contact frame in the base frame, metres.
        rotations: (m, 3, 3) rotations of the contact frame in the base frame.
        jacobians: (m, 3, n) Jacobians $J$ of the positions in the base frame.
        coms: (m, 3) centres of mass of the limb in the base frame, metres.

    Attributes:
        joints: (m, n) valid configurations of the limb, sorted by cell, radians or metres.
        positions: (m, 3) origins of the contact frame in the base frame, metres.
        rotations: (m, 3, 3) rotations of the contact frame in the base frame.
        coms: (m, 3) centres of mass of the limb in the base frame, metres.
        grams: (m, 3, 3) matrices $J J^T$.
        manipulability: (m,) manipulability $h_w$, cubic metres for a limb of revolute joints.
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
        """Axis-aligned box in the world that contains all effector positions, metres.

        Args:
            rotation: (3, 3) rotation of the limb's base in the world.
            translation: (3,) position of the limb's base in the world, metres.

        Returns:
            Corner (3,) of the smallest coordinates, and corner (3,) of the largest.
        """
        corners = self._box @ rotation.T + translation
        return corners.min(axis=0), corners.max(axis=0)

    def near(
        self, normals: Array, offsets: Array, edge_normals: Array, edge_offsets: Array, band: float
    ) -> tuple[IntArray, IntArray]:
        r"""Samples whose effector is close to the plane of a convex piece and projects onto it.

        A point $x$ is taken where $|n \cdot x - d| \le$ band for the piece's plane $(n, d)$ and
        $m \cdot x \ge c$ for the half-spaces $(m, c)$ of all its edges. Frame: the limb's base.

        Args:
            normals: (p, 3) unit normals $n$ of the pieces' planes.
            offsets: (p,) offsets $d$ of the pieces' planes, metres.
            edge_normals: (p, e, 3) unit normals $m$ of the edges in the planes, inward.
            edge_offsets: (p, e) offsets $c$ of the edges, metres.
            band: largest distance from the plane on either side, metres.

        Returns:
            Indices (h,) of the samples, and indices (h,) of the pieces that they are close to.
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
    columns: Array, sample: IntArray, normals: Array, offsets: Array, piece: IntArray
) -> Array:
    """Signed distances (h,) of samples to the planes of pieces, metres.

    It is summed column by column: gathering rows of three numbers takes several times as long.

    Args:
        columns: (3, m) positions of all samples, metres.
        sample: (h,) indices of samples.
        normals: (p, 3) unit normals of the planes.
        offsets: (p,) offsets of the planes, metres.
        piece: (h,) indices of pieces.
    """
    height = -offsets[piece]
    for column, normal in zip(columns, normals.T, strict=True):
        height += column[sample] * normal[piece]
    return height
