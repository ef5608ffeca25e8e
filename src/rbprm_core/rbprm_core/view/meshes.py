"""Small operations on triangle meshes that the page and the picture share. Metres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
import trimesh
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

SHARP_EDGE = np.deg2rad(12)  # a flatter edge between triangles is not worth a line


def joined(meshes: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """One mesh of many; an empty one of none."""
    whole = trimesh.util.concatenate(list(meshes)) if meshes else trimesh.Trimesh()
    assert isinstance(whole, trimesh.Trimesh)  # what trimesh makes of meshes only
    return whole


def thinned(mesh: trimesh.Trimesh, digits: int) -> trimesh.Trimesh:
    """A copy with vertices merged that agree to so many decimals of a metre."""
    copy = mesh.copy()
    copy.merge_vertices(digits_vertex=digits)
    copy.update_faces(copy.unique_faces() & copy.nondegenerate_faces())
    copy.remove_unreferenced_vertices()
    return copy


def sharp_edges(mesh: trimesh.Trimesh) -> Array:
    """(k, 2, 3) segments where a mesh ends or bends: the lines that a draughtsman draws."""
    bends = mesh.face_adjacency_edges[mesh.face_adjacency_angles > SHARP_EDGE]
    edges, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    segments: Array = np.array(mesh.vertices)[np.vstack((bends, edges[counts == 1]))]
    return segments


def flat_mesh(polygon: shapely.Polygon) -> trimesh.Trimesh:
    """Triangles of a polygon with holes in the plane z = 0, seen from above."""
    points, faces = trimesh.creation.triangulate_polygon(polygon, engine="earcut")
    mesh = trimesh.Trimesh(np.column_stack((points, np.zeros(len(points)))), faces)
    if mesh.face_normals[:, 2].sum() < 0:
        mesh.invert()
    return mesh


def frame_on(position: ArrayLike, normal: Array, along: ArrayLike = (1.0, 0.0, 0.0)) -> Array:
    """(4, 4) frame on a plane: z along the unit normal, x as far as can be along a direction."""
    x = np.asarray(along, dtype=float)
    x = x - (x @ normal) * normal
    if np.linalg.norm(x) < 1e-6 * np.linalg.norm(along):
        x = np.eye(3)[np.abs(normal).argmin()]
        x -= (x @ normal) * normal
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack((x, np.cross(normal, x), normal))
    frame[:3, 3] = position
    return frame
