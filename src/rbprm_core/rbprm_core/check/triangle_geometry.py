"""Geometry of arrays of triangles (n, 3, 3): triangle, corner, axis; metres.

Corners are counter-clockwise seen from outside.
"""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rbprm_core.arrays import Array, IntArray

MERGE_DISTANCE = 1e-6  # metres; corners that agree to this are one vertex
INSIDE = 0.5  # winding number above which a point is inside

# Typed as Any, since this function of trimesh has no annotations.
_closest_point: Any = trimesh.triangles.closest_point


def triangle_distances(triangles: Array, point: Array) -> Array:
    """Return the distance (n,) of each triangle from one point, metres.

    Args:
        triangles: (n, 3, 3) triangles, metres.
        point: (3,) point, metres.
    """
    if not len(triangles):
        return np.zeros(0)
    targets = np.broadcast_to(point, (len(triangles), 3))
    closest = _closest_point(triangles, targets)
    return np.asarray(np.linalg.norm(closest - point, axis=1), dtype=float)


def point_distances(triangle: Array, points: Array) -> Array:
    """Return the distance (n,) of each point from one triangle, metres.

    Args:
        triangle: (3, 3) corners, metres.
        points: (n, 3) points, metres.
    """
    triangles = np.broadcast_to(triangle, (len(points), 3, 3))
    closest = _closest_point(triangles, points)
    return np.asarray(np.linalg.norm(closest - points, axis=1), dtype=float)


def by_corner(triangles: Array) -> Array:
    """Return triangles as a contiguous array (corner, axis, n) for `winding_number`.

    Args:
        triangles: (n, 3, 3) triangles, metres.
    """
    return np.ascontiguousarray(triangles.transpose(1, 2, 0))


def winding_number(corners: Array, point: Array) -> float:
    r"""Return the generalised winding number of triangles about a point (Jacobson et al. 2013).

    It is the sum of the signed solid angles of the triangles divided by $4 \pi$. With corners
    $a, b, c$ relative to the point, the solid angle $\Omega$ is (Van Oosterom and Strackee 1983)

    $\tan \frac{\Omega}{2} = \frac{a \cdot (b \times c)}{d}$ with
    $d = |a||b||c| + (a \cdot b)|c| + (b \cdot c)|a| + (c \cdot a)|b|$

    Args:
        corners: (3, 3, n) triangles as `by_corner` returns them, metres.
        point: (3,) point, metres.

    Returns:
        1 inside a closed surface that faces outwards, 0 outside, in between near open surfaces.
    """
    a, b, c = arms = corners - point[:, None]
    la, lb, lc = np.sqrt(np.einsum("ijk,ijk->ik", arms, arms))
    ab, bc, ca = (np.einsum("ij,ij->j", u, v) for u, v in ((a, b), (b, c), (c, a)))
    # Written out: this is the inner loop of the check, and np.cross takes most of its time.
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    half_angles = np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return float(half_angles.sum() / (2 * np.pi))


def component_labels(triangles: Array) -> IntArray:
    """Return the label (n,) of the connected component of each triangle.

    Triangles that share a corner are connected.

    Args:
        triangles: (n, 3, 3) triangles, metres, at least one.
    """
    corners = np.round(triangles.reshape(-1, 3) / MERGE_DISTANCE).astype(np.int64)
    _, vertex = np.unique(corners, axis=0, return_inverse=True)
    ends = vertex.reshape(-1, 3)
    rows, columns = ends[:, [0, 1]].ravel(), ends[:, [1, 2]].ravel()
    size = int(ends.max()) + 1
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1][ends[:, 0]])


def components(triangles: Array) -> list[IntArray]:
    """Return the indices of the triangles of every connected component.

    Args:
        triangles: (n, 3, 3) triangles, metres, at least one.
    """
    label = component_labels(triangles)
    order = np.argsort(label, kind="stable")
    return list(np.split(order, np.flatnonzero(np.diff(label[order])) + 1))


def mesh_triangles(bvh: Any) -> Array:
    """Return the triangles (n, 3, 3) of a coal mesh in its own frame, metres.

    Args:
        bvh: mesh of coal.
    """
    faces = [[bvh.tri_indices(k)[c] for c in range(3)] for k in range(bvh.num_tris)]
    vertices = np.array(bvh.vertices(), dtype=float)
    return np.asarray(vertices[np.array(faces, dtype=int).reshape(-1, 3)], dtype=float)


def collision_mesh(triangles: Array) -> Any:
    """Return a coal mesh with a bounding volume hierarchy; triangles keep their order.

    Args:
        triangles: (n, 3, 3) triangles, metres.
    """
    bvh = coal.BVHModelOBBRSS()
    bvh.beginModel(len(triangles), 3 * len(triangles))
    bvh.addVertices(triangles.reshape(-1, 3))
    bvh.addTriangles(np.arange(3 * len(triangles)).reshape(-1, 3))
    bvh.endModel()
    bvh.computeLocalAABB()
    return bvh
