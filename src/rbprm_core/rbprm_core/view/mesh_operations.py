"""Operations on triangle meshes that the page and the picture share, in metres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
import trimesh
from numpy.typing import ArrayLike

from rbprm_core.arrays import Array

SHARP_EDGE = np.deg2rad(12)  # radians between triangles; flatter edges are not drawn


def joined(meshes: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Return many meshes as one, which is empty if there are none.

    Args:
        meshes: meshes in the same frame.
    """
    whole = trimesh.util.concatenate(list(meshes)) if meshes else trimesh.Trimesh()
    assert isinstance(whole, trimesh.Trimesh)  # the type that trimesh returns for meshes only
    return whole


def thinned(mesh: trimesh.Trimesh, digits: int) -> trimesh.Trimesh:
    """Return a copy of a mesh with vertices merged that agree after rounding.

    Args:
        mesh: mesh, metres.
        digits: number of decimals to which coordinates are rounded.
    """
    copy = mesh.copy()
    copy.merge_vertices(digits_vertex=digits)
    copy.update_faces(copy.unique_faces() & copy.nondegenerate_faces())
    copy.remove_unreferenced_vertices()
    return copy


def sharp_edges(mesh: trimesh.Trimesh) -> Array:
    """Return the segments (k, 2, 3) where a mesh ends or has a sharp edge, metres.

    Args:
        mesh: mesh, metres.
    """
    bends = mesh.face_adjacency_edges[mesh.face_adjacency_angles > SHARP_EDGE]
    edges, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    segments: Array = np.array(mesh.vertices)[np.vstack((bends, edges[counts == 1]))]
    return segments


def flat_mesh(polygon: shapely.Polygon) -> trimesh.Trimesh:
    """Return a polygon with holes as triangles in the plane z = 0 that face upwards.

    Args:
        polygon: polygon, metres.
    """
    points, faces = trimesh.creation.triangulate_polygon(polygon, engine="earcut")
    mesh = trimesh.Trimesh(np.column_stack((points, np.zeros(len(points)))), faces)
    if mesh.face_normals[:, 2].sum() < 0:
        mesh.invert()
    return mesh


def frame_on(position: ArrayLike, normal: Array, along: ArrayLike = (1.0, 0.0, 0.0)) -> Array:
    """Return a frame (4, 4) on a plane with its z axis along the normal.

    Args:
        position: (3,) origin of the frame, metres.
        normal: (3,) unit normal of the plane.
        along: (3,) direction whose projection on the plane is the x axis; any x axis is taken if it
            is along the normal.
    """
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
