"""The volumes of the reachability condition (appendix A): W0 of the trunk, Wk of each limb."""

from __future__ import annotations

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from rbprm_core.errors import InvalidInput
from rbprm_core.robot.model import ROOT_JOINT, Robot

Array = NDArray[np.float64]


def reachable_workspace(positions: Array, faces: int) -> Array:
    """Vertices (v, 3) of the workspace Wk in the limb's base frame, metres (appendix A.1).

    Args:
        positions: (m, 3) effector centres of valid limb configurations.
        faces: most faces of the result.
    """
    return simplify(positions[ConvexHull(positions).vertices], faces)


def simplify(corners: Array, faces: int) -> Array:
    """A few of the corners (n, 3) of a convex body: a polytope inside it with at most `faces`.

    Greedy: from a tetrahedron of far corners, add the corner that lies farthest outside until the
    faces are used up (a triangulated hull of v corners has 2 v - 4). Inner, hence conservative, as
    the decimation of appendix A.1 is meant to be: what is lost lies near the limb's singularities.
    """
    most = max(4, (faces + 4) // 2)
    chosen = [int(np.argmin(corners[:, 0])), int(np.argmax(corners[:, 0]))]
    line = corners[chosen[1]] - corners[chosen[0]]
    off_line = np.linalg.norm(np.cross(corners - corners[chosen[0]], line), axis=1)
    chosen.append(int(np.argmax(off_line)))
    normal = np.cross(line, corners[chosen[2]] - corners[chosen[0]])
    chosen.append(int(np.argmax(np.abs((corners - corners[chosen[0]]) @ normal))))
    while len(chosen) < min(most, len(corners)):
        equations = ConvexHull(corners[chosen]).equations
        outside = (corners @ equations[:, :3].T + equations[:, 3]).max(axis=1)
        farthest = int(np.argmax(outside))
        if outside[farthest] < 1e-6:
            break
        chosen.append(farthest)
    return np.asarray(corners[sorted(chosen)])


@dataclass(frozen=True, eq=False)
class TrunkPiece:
    """A convex piece of W0.

    Attributes:
        joint: id of the joint that carries it: the root's, or one planned with the root.
        corners: (n, 3) in that joint's frame, metres.
    """

    joint: int
    corners: Array


def trunk_volume(robot: Robot, scale: float) -> list[TrunkPiece]:
    """The pieces of W0 (appendix A.2): bounding boxes of some links, scaled by s.

    One box a collision geometry, scaled about its centre. Links that move against the root, such as
    the upper legs that the paper includes, are taken where the reference posture puts them.

    Raises:
        InvalidInput: a trunk link that does not exist or has no geometry.
    """
    supporting_surfaces = {ROOT_JOINT, *robot.root_joints}
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, robot.reference)
    pieces = []
    for link in robot.description.volumes.trunk_links:
        bodies = [g for g in robot.geometry.geometryObjects if _link_of(robot, g) == link]
        if not bodies:
            known = sorted({_link_of(robot, g) for g in robot.geometry.geometryObjects})
            reason = f"no collision geometry; links that have one: {', '.join(known)}"
            raise InvalidInput("volumes.trunk_links", link, reason)
        for body in bodies:
            supporting_surface = body.parentJoint
            while supporting_surface not in supporting_surfaces:
                supporting_surface = robot.model.parents[supporting_surface]
            carried = data.oMi[supporting_surface].actInv(data.oMi[body.parentJoint])
            corners = np.array([carried.act(corner) for corner in _box(body, scale)])
            pieces.append(TrunkPiece(supporting_surface, corners))
    return pieces


def _link_of(robot: Robot, body: pin.GeometryObject) -> str:
    return str(robot.model.frames[body.parentFrame].name)


def _box(body: pin.GeometryObject, scale: float) -> Array:
    """Corners (8, 3) of a body's box along its joint's axes, scaled about its centre, metres."""
    shape = body.geometry
    shape.computeLocalAABB()
    if isinstance(shape, coal.BVHModelBase):
        points = np.asarray(shape.vertices())
    else:
        points = _corners(np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_))
    placed = points @ body.placement.rotation.T + body.placement.translation
    low, high = placed.min(axis=0), placed.max(axis=0)
    middle, half = (low + high) / 2, scale * (high - low) / 2
    return _corners(middle - half, middle + half)


def _corners(low: Array, high: Array) -> Array:
    """The 8 corners (8, 3) of a box."""
    return low + np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T * (high - low)
