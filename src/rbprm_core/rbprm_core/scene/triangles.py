"""Operations on arrays of triangles (n, 3, 3): triangle, corner, axis; metres."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rbprm_core.arrays import Array, IntArray

MERGE_DISTANCE = 1e-6  # metres; corners that agree to this are one vertex


def fan_triangles(pieces: Sequence[Array]) -> Array:
    """Return the triangles (n, 3, 3) of convex polygons, each cut into a fan from its first corner.

    All polygons are cut at once, since scenes have thousands of them.

    Args:
        pieces: convex polygons, each (m, 3) corners, metres.
    """
    if not pieces:
        return np.zeros((0, 3, 3))
    counts, starts = corner_offsets(pieces)
    each = counts - 2
    first = np.repeat(starts, each)
    second = first + 1 + np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    return np.asarray(np.concatenate(pieces)[np.column_stack([first, second, second + 1])])


def corner_offsets(pieces: Sequence[Array]) -> tuple[IntArray, IntArray]:
    """Return the number of corners of each piece, and the index of its first among those of all.

    Args:
        pieces: p polygons, each (m, 3) corners.

    Returns:
        Two arrays (p,): number of corners, and index of the first in the concatenated pieces.
    """
    counts = np.array([len(piece) for piece in pieces])
    return counts, np.cumsum(counts) - counts


def mesh_shape(triangles: Array) -> coal.BVHModelOBBRSS:
    """Return triangles as a coal mesh with a bounding volume hierarchy.

    Args:
        triangles: (n, 3, 3) triangles, metres.
    """
    shape = coal.BVHModelOBBRSS()
    shape.beginModel(len(triangles), 3 * len(triangles))
    shape.addVertices(np.ascontiguousarray(triangles.reshape(-1, 3)))
    shape.addTriangles(np.arange(3 * len(triangles), dtype=np.int64).reshape(-1, 3))
    shape.endModel()
    return shape


def spatial_parts(triangles: Array, max_count: int) -> list[Array]:
    """Return triangles in parts of neighbours, halved along the longest axis until small enough.

    Args:
        triangles: (n, 3, 3) triangles, metres.
        max_count: greatest number of triangles in a part.
    """
    if len(triangles) <= max_count:
        return [triangles]
    middles = triangles.mean(axis=1)
    axis = int(np.argmax(np.ptp(middles, axis=0)))
    order = np.argsort(middles[:, axis], kind="stable")
    half = len(order) // 2
    return [
        *spatial_parts(triangles[order[:half]], max_count),
        *spatial_parts(triangles[order[half:]], max_count),
    ]


def solid_angles(triangles: Array) -> Array:
    r"""Return the signed solid angle (n,) of triangles seen from the origin, in full turns.

    With corners $a, b, c$, the solid angle $\Omega$ is (Van Oosterom and Strackee 1983)

    $\tan \frac{\Omega}{2} = \frac{a \cdot (b \times c)}{d}$ with
    $d = |a||b||c| + (a \cdot b)|c| + (b \cdot c)|a| + (c \cdot a)|b|$

    Args:
        triangles: (n, 3, 3) triangles relative to the point from which they are seen, metres.

    Returns:
        $\Omega / 4 \pi$ of each triangle, positive where its outward side faces away.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    bottom = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    return np.asarray(np.arctan2(top, bottom) / (2 * np.pi))


def component_labels(triangles: Array) -> IntArray:
    """Return the label (n,) of the connected component of each triangle.

    Triangles that share a corner are connected.

    Args:
        triangles: (n, 3, 3) triangles, metres.
    """
    corners = np.round(triangles.reshape(-1, 3) / MERGE_DISTANCE).astype(np.int64)
    _, vertex = np.unique(corners, axis=0, return_inverse=True)
    faces = vertex.reshape(-1, 3)
    size = int(faces.max()) + 1 if len(faces) else 0
    rows, columns = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    _, labels = connected_components(graph, directed=False)
    return np.asarray(labels[faces[:, 0]]) if len(faces) else np.zeros(0, dtype=int)
