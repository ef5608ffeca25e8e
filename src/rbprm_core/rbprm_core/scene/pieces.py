"""Convex pieces of contact surfaces as arrays, for queries on many points at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rbprm_core.arrays import Array, BoolArray, IntArray
from rbprm_core.scene.surface import Surface
from rbprm_core.scene.triangles import corner_offsets
from rbprm_core.surface_kind import SurfaceKind


@dataclass(frozen=True, eq=False)
class Pieces:
    r"""p convex pieces of surfaces with at most e edges each; planning frame.

    A point $x$ of the plane lies in a piece where $n_k \cdot x \geq d_k$ for each of its edges k.

    Attributes:
        surface: (p,) index in the scene of the surface of each piece.
        friction: (p,) coefficient of Coulomb friction.
        normals: (p, 3) outward unit normal $n$.
        offsets: (p,) distance $d$ of the plane $n \cdot x = d$ from the origin, metres.
        edge_normals: (p, e, 3) inward unit normal $n_k$ of each edge, in the plane; zero where a
            piece has fewer edges.
        edge_offsets: (p, e) offset $d_k$ of each edge, metres; minus infinity where a piece has
            fewer edges.
        outer: (p, e) True where an edge lies on the boundary of the surface, False where it is
            shared with another piece.
        low: (p, 3) lowest corner of the bounding box, metres.
        high: (p, 3) highest corner of the bounding box, metres.
    """

    surface: IntArray
    friction: Array
    normals: Array
    offsets: Array
    edge_normals: Array
    edge_offsets: Array
    outer: BoolArray
    low: Array
    high: Array


def pieces_of_kinds(surfaces: Sequence[Surface], kinds: Sequence[SurfaceKind]) -> Pieces:
    """Return the convex pieces of the surfaces of some kinds.

    Args:
        surfaces: surfaces of a scene, in its order.
        kinds: kinds of surfaces to include.
    """
    chosen = [(i, surface) for i, surface in enumerate(surfaces) if surface.kind in kinds]
    owner = np.array([i for i, surface in chosen for _ in surface.polygon.pieces], dtype=int)
    if not len(owner):
        return _no_pieces()
    normals = np.array([surfaces[i].normal for i in owner]).reshape(-1, 3)
    pieces = [piece for _, surface in chosen for piece in surface.polygon.pieces]
    is_outer = [edges for _, surface in chosen for edges in surface.polygon.outer_edges]
    corners = np.concatenate(pieces)
    counts, starts = corner_offsets(pieces)
    edge_normals, edge_offsets, outer = _edges(corners, normals, counts, starts, is_outer)
    return Pieces(
        surface=owner,
        friction=np.array([surfaces[i].friction for i in owner]),
        normals=normals,
        offsets=np.einsum("ij,ij->i", normals, corners[starts]),
        edge_normals=edge_normals,
        edge_offsets=edge_offsets,
        outer=outer,
        low=np.minimum.reduceat(corners, starts),
        high=np.maximum.reduceat(corners, starts),
    )


def _edges(
    corners: Array,
    normals: Array,
    counts: IntArray,
    starts: IntArray,
    is_outer: Sequence[BoolArray],
) -> tuple[Array, Array, BoolArray]:
    """Return `edge_normals`, `edge_offsets` and `outer` of `Pieces`, padded to e edges."""
    piece = np.repeat(np.arange(len(counts)), counts)
    after = np.arange(1, len(corners) + 1)
    after[starts + counts - 1] = starts
    inward = np.cross(normals[piece], corners[after] - corners)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    place = piece, np.arange(len(corners)) - starts[piece]
    edge_normals = np.zeros((len(counts), counts.max(), 3))
    edge_offsets = np.full(edge_normals.shape[:2], -np.inf)
    outer = np.zeros(edge_normals.shape[:2], dtype=bool)
    edge_normals[place] = inward
    edge_offsets[place] = (inward * corners).sum(axis=1)
    outer[place] = np.concatenate(is_outer)
    return edge_normals, edge_offsets, outer


def _no_pieces() -> Pieces:
    return Pieces(
        surface=np.zeros(0, dtype=int),
        friction=np.zeros(0),
        normals=np.zeros((0, 3)),
        offsets=np.zeros(0),
        edge_normals=np.zeros((0, 0, 3)),
        edge_offsets=np.zeros((0, 0)),
        outer=np.zeros((0, 0), dtype=bool),
        low=np.zeros((0, 3)),
        high=np.zeros((0, 3)),
    )
