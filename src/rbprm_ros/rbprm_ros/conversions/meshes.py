"""Conversion of triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from shape_msgs.msg import Mesh, MeshTriangle

from rbprm_core.errors import InvalidInput
from rbprm_core.validation import MAX_COORDINATE
from rbprm_ros.settings import Settings

Array = NDArray[np.float64]

MIN_TRIANGLE = 1e-12  # square metres; the normals of smaller triangles mean nothing
CORNERS_PER_TRIANGLE = 3


def triangles_of_mesh(message: Mesh, field: str) -> Array:
    """The triangles (n, 3, 3) of a mesh, metres.

    Args:
        message: the mesh.
        field: field of the message that holds the mesh, for errors.

    Raises:
        InvalidInput: no triangles, an index out of range, a vertex that is not finite or beyond 100
            km, or a triangle without an area.
    """
    if not message.triangles:
        reason = "has no triangles: leave the obstacle out, or name its id in removed_ids"
        raise InvalidInput(f"{field}.triangles", [], reason)
    vertices = points_array(message.vertices, f"{field}.vertices")
    faces = np.array([t.vertex_indices for t in message.triangles], dtype=np.int64)
    outside = (faces >= len(vertices)).any(axis=1)
    if outside.any():
        i = int(outside.argmax())
        reason = f"must index the mesh's {len(vertices)} vertices, from 0"
        raise InvalidInput(f"{field}.triangles.{i}", faces[i].tolist(), reason)
    triangles = vertices[faces]
    flat = areas(triangles) < MIN_TRIANGLE
    if flat.any():
        i = int(flat.argmax())
        reason = f"has no area: its corners are {triangles[i].tolist()}; leave it out"
        raise InvalidInput(f"{field}.triangles.{i}", faces[i].tolist(), reason)
    return triangles


def mesh_message(triangles: Array) -> Mesh:
    """The mesh of triangles (n, 3, 3), metres; a shared corner is one vertex.

    Args:
        triangles: (n, 3, 3) corners of the triangles, metres.
    """
    corners, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    rows = faces.reshape(-1, 3).astype(np.uint32)
    return Mesh(
        vertices=[Point(x=x, y=y, z=z) for x, y, z in corners.tolist()],
        triangles=[MeshTriangle(vertex_indices=row) for row in rows],
    )


def points_array(points: Sequence[Point], field: str) -> Array:
    """The points (n, 3) of a message, metres.

    Args:
        points: the points.
        field: field of the message that holds the points, for errors.

    Raises:
        InvalidInput: names the first point that is not finite, or beyond 100 km.
    """
    array = np.array([(p.x, p.y, p.z) for p in points], dtype=float).reshape(-1, 3)
    bad = ~(np.abs(array) <= MAX_COORDINATE).all(axis=1)  # NaN too
    if bad.any():
        i = int(bad.argmax())
        reason = f"must be finite and within {MAX_COORDINATE:g} m of the origin"
        raise InvalidInput(f"{field}.{i}", array[i].tolist(), reason)
    return array


def areas(triangles: Array) -> Array:
    """The areas (n,) of triangles (n, 3, 3), square metres.

    Args:
        triangles: (n, 3, 3) corners of the triangles, metres.
    """
    sides = triangles[:, 1:] - triangles[:, :1]
    return np.asarray(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2)


def require_triangles(field: str, count: int, settings: Settings) -> None:
    """Refuse more triangles than the parameter `max_triangles` allows.

    Args:
        field: field of the message, for the error.
        count: number of triangles.
        settings: parameters of the node.
    """
    if count > settings.max_triangles:
        reason = f"are too many; the parameter max_triangles is {settings.max_triangles}"
        raise InvalidInput(field, f"{count} triangles", reason)
