"""The volumes of the reachability condition: trunk volume and reachable workspace of each limb.

They are $W^0$ and $W^k$ of Tonneau et al. 2018, appendix A.
"""

from __future__ import annotations

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.model import ROOT_JOINT, Robot


def reachable_workspace(positions: Array, max_faces: int) -> Array:
    """Vertices (v, 3) of a limb's reachable workspace in the limb's base frame, metres.

    The workspace $W^k$ is the convex hull of effector positions, simplified (Tonneau et al. 2018,
    appendix A.1).

    Args:
        positions: (m, 3) effector positions of valid limb configurations in the base frame, metres.
        max_faces: largest number of triangular faces of the result.
    """
    return simplify(positions[ConvexHull(positions).vertices], max_faces)


def simplify(corners: Array, max_faces: int) -> Array:
    """Corners (v, 3) of a polytope inside a convex body, chosen from the body's corners, metres.

    A greedy method: starting from a tetrahedron of distant corners, it adds the corner farthest
    outside until the faces are used up; a triangulated hull of $v$ corners has $2 v - 4$ faces. The
    result lies inside the body, so it is conservative, as the decimation of Tonneau et al. 2018,
    appendix A.1, is meant to be: the volume lost lies near the limb's singularities.

    Args:
        corners: (n, 3) corners of the body, metres.
        max_faces: largest number of triangular faces of the result; at least 4 are made.
    """
    max_corners = max(4, (max_faces + 4) // 2)
    chosen = [int(np.argmin(corners[:, 0])), int(np.argmax(corners[:, 0]))]
    line = corners[chosen[1]] - corners[chosen[0]]
    off_line = np.linalg.norm(np.cross(corners - corners[chosen[0]], line), axis=1)
    chosen.append(int(np.argmax(off_line)))
    normal = np.cross(line, corners[chosen[2]] - corners[chosen[0]])
    chosen.append(int(np.argmax(np.abs((corners - corners[chosen[0]]) @ normal))))
    while len(chosen) < min(max_corners, len(corners)):
        equations = ConvexHull(corners[chosen]).equations
        outside = (corners @ equations[:, :3].T + equations[:, 3]).max(axis=1)
        farthest = int(np.argmax(outside))
        if outside[farthest] < 1e-6:
            break
        chosen.append(farthest)
    return np.asarray(corners[sorted(chosen)])


@dataclass(frozen=True, eq=False)
class TrunkPiece:
    """A convex piece of the trunk volume $W^0$.

    Attributes:
        joint: id of the joint that the piece moves with: the root's, or one planned with the root.
        corners: (n, 3) corners of the piece in that joint's frame, metres.
    """

    joint: int
    corners: Array


def trunk_volume(robot: Robot, scale: float) -> list[TrunkPiece]:
    """The pieces of the trunk volume $W^0_s$: bounding boxes of some links, scaled.

    Each collision geometry of a trunk link gives one box, scaled about its centre (Tonneau et al.
    2018, appendix A.2). Links that move relative to the root, such as the upper legs that the
    appendix includes, are placed as in the reference posture.

    Args:
        robot: the robot; its description names the trunk links.
        scale: scaling factor $s$ (Tonneau et al. 2018, section 3.2).

    Raises:
        InvalidInput: a trunk link that does not exist or has no geometry.
    """
    root_part = {ROOT_JOINT, *robot.root_joints}
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
            joint = body.parentJoint
            while joint not in root_part:
                joint = robot.model.parents[joint]
            placement = data.oMi[joint].actInv(data.oMi[body.parentJoint])
            corners = np.array([placement.act(corner) for corner in _box(body, scale)])
            pieces.append(TrunkPiece(joint, corners))
    return pieces


def _link_of(robot: Robot, body: pin.GeometryObject) -> str:
    return str(robot.model.frames[body.parentFrame].name)


def _box(body: pin.GeometryObject, scale: float) -> Array:
    """Corners (8, 3) of a body's bounding box in its joint's frame, scaled, metres."""
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
    """Corners (8, 3) of an axis-aligned box given by two opposite corners (3,)."""
    return low + np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T * (high - low)
