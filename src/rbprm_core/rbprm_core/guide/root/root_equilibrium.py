"""Static equilibrium as a further condition on roots (optional).

Tonneau et al. 2018 leave an equilibrium criterion for the guide to future work (section 7). The
reachability condition requires that each limb could touch a surface, not that the contacts could
bear the robot. Here, all points that the required limbs could touch are taken as contacts at once.
If even these do not hold the robot, no choice among them does. The forces that a limb can exert
over a polygon are sums of those at the polygon's corners, so that the corners of each surface
clipped by the limb's workspace suffice.
"""

from __future__ import annotations

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from rbprm_core.arrays import Array, IntArray
from rbprm_core.guide.root.root_kinematics import RootKinematics
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.limb import Limb
from rbprm_core.scene import Scene
from rbprm_core.statics import Equilibrium, cone_generators, robustness

ROUNDING = 1e-6  # share of the weight by which a robustness may be negative because of rounding
ON_EDGE = 1e-9  # m; corners shared by two edges belong to both


class EquilibriumTest:
    """Necessary condition for static equilibrium at a root configuration.

    The condition is necessary but for three approximations: the workspaces, the friction cones,
    which are linearised from inside, and the centre of mass, which is that of the reference
    posture.

    Not thread-safe: it holds scratch data.

    Args:
        data: robot with its limb workspaces.
        scene: scene in the planning frame.
        required: names of the limbs that may bear weight.
        gravity: (3,) gravity in the planning frame, m/s^2.
    """

    def __init__(
        self, data: RobotData, scene: Scene, required: tuple[str, ...], gravity: Array
    ) -> None:
        self._robot, self._gravity, self._mass = data.robot, gravity, data.robot.mass
        self._limbs = [
            _LimbSupport.of(limb, data.workspaces[k], data.faces[k], scene)
            for k, limb in enumerate(data.robot.limbs)
            if limb.name in required
        ]
        bases = [limb.base for limb in data.robot.limbs if limb.name in required]
        self._bases = RootKinematics(data.robot, bases)
        self._data = data.robot.model.createData()
        self._q = data.robot.reference.copy()

    def holds(self, root: Array) -> bool:
        """True where contacts within the limbs' workspaces could bear the robot's weight.

        Args:
            root: (7 + j,) root configuration.
        """
        if not self._gravity.any():
            return True  # there is no weight
        if not self._limbs:
            return False
        self._q[self._robot.root_index] = root
        com = pin.centerOfMass(self._robot.model, self._data, self._q, False)
        found = [
            limb.contacts(base)
            for limb, base in zip(self._limbs, self._bases.placements(root), strict=True)
        ]
        points, cones = (np.concatenate(parts) for parts in zip(*found, strict=True))
        problem = Equilibrium.of(points, cones, com, self._mass, self._gravity)
        weight = self._mass * float(np.linalg.norm(self._gravity))
        return robustness(problem) >= -ROUNDING * weight


@dataclass(frozen=True, eq=False)
class _LimbSupport:
    """A limb's workspace and the surfaces that it may use, as p convex pieces of up to e corners.

    Pieces are those on which the centre of the limb's contact spot lies: the surfaces' pieces
    moved outwards by the spot's radius.

    Attributes:
        workspace: (v, 3) corners of the workspace $W_k$ in the base frame, m.
        faces: (f, 4) faces of the workspace in the base frame: inside where n . x + d <= 0.
        edges: (g, 2) indices of the ends of the workspace's edges.
        patch_radius: largest distance of the limb's contact points from the spot's centre, m; 0 for
            a ball.
        rings: (p, e, 3) corners of the pieces, the last one repeated, m.
        axes: (p, 3, 3) rotations of the pieces with columns t1, t2, n.
        cones: (p, 4, 3) generators of the friction cones.
        planes: (p,) offsets n . x of the pieces' planes, m.
        edge_normals: (p, e, 3) inward normals of the pieces' edges.
        edge_offsets: (p, e) offsets of the pieces' edges: inside where edge_normal . x >= offset.
        low: (p, 3) lowest corners of the pieces' bounding boxes, m.
        high: (p, 3) highest corners of the pieces' bounding boxes, m.
        radius: radius of the limb's contact spot, m.
    """

    workspace: Array
    faces: Array
    edges: IntArray
    patch_radius: float
    rings: Array
    axes: Array
    cones: Array
    planes: Array
    edge_normals: Array
    edge_offsets: Array
    low: Array
    high: Array
    radius: float

    @staticmethod
    def of(limb: Limb, workspace: Array, faces: Array, scene: Scene) -> _LimbSupport:
        """Support of a limb in a scene.

        Args:
            limb: the limb.
            workspace: (v, 3) corners of its workspace in the base frame, m.
            faces: (f, 4) faces of its workspace in the base frame.
            scene: scene in the planning frame.
        """
        pieces = scene.pieces(limb.surfaces)
        surfaces = [s for s in scene.surfaces if s.kind in limb.surfaces]
        corners = [piece for s in surfaces for piece in s.polygon.pieces]
        count = pieces.edge_offsets.shape[1]
        lifts = limb.radius * pieces.normals
        rings = [
            np.concatenate([ring, np.repeat(ring[-1:], count - len(ring), axis=0)]) + lift
            for ring, lift in zip(corners, lifts, strict=True)
        ]
        axes = [
            np.column_stack([s.polygon.plane.axes, s.normal])
            for s in surfaces
            for _ in s.polygon.pieces
        ]
        cones = [cone_generators(a, f) for a, f in zip(axes, pieces.friction, strict=True)]
        simplices = ConvexHull(workspace).simplices
        edges = np.sort(simplices[:, [0, 1, 1, 2, 0, 2]].reshape(-1, 2), axis=1)
        return _LimbSupport(
            workspace=workspace,
            faces=faces,
            edges=np.unique(edges, axis=0),
            patch_radius=0.0 if limb.half_size is None else float(np.linalg.norm(limb.half_size)),
            rings=np.array(rings).reshape(-1, count, 3),
            axes=np.array(axes).reshape(-1, 3, 3),
            cones=np.array(cones).reshape(-1, 4, 3),
            planes=pieces.offsets + limb.radius,
            edge_normals=pieces.edge_normals,
            edge_offsets=pieces.edge_offsets,
            low=pieces.low + np.minimum(lifts, 0),
            high=pieces.high + np.maximum(lifts, 0),
            radius=limb.radius,
        )

    def contacts(self, base: coal.Transform3s) -> tuple[Array, Array]:
        """Corners (n, 3) of the surfaces clipped by the workspace, and their cones (n, 4, 3).

        Args:
            base: placement of the limb's base in the planning frame.
        """
        rotation, origin = base.getRotation(), base.getTranslation()
        body = self.workspace @ rotation.T + origin
        near = (self.low <= body.max(axis=0)) & (self.high >= body.min(axis=0))
        chosen = np.flatnonzero(near.all(axis=1))
        normals = self.faces[:, :3] @ rotation.T
        offsets = self.faces[:, 3] - normals @ origin
        parts = [
            self._cut_edges(body, chosen),
            _clip_rings(self.rings[chosen], normals, offsets),
        ]
        points = np.concatenate([points for points, _ in parts])
        piece = chosen[np.concatenate([index for _, index in parts])]
        points = points - self.radius * self.axes[piece][:, :, 2]
        if self.patch_radius > 0:  # forces act within the patch, around the spot's centre
            spread = self.patch_radius * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
            points = points[:, None] + spread @ np.swapaxes(self.axes[piece][:, :, :2], 1, 2)
            points, piece = points.reshape(-1, 3), np.repeat(piece, 4)
        return points, self.cones[piece]

    def _cut_edges(self, body: Array, chosen: IntArray) -> tuple[Array, IntArray]:
        """Points (n, 3) where the workspace's edges cross pieces, and these pieces (n,).

        Args:
            body: (v, 3) corners of the workspace in the planning frame, m.
            chosen: (m,) indices of pieces near the workspace; the result refers to places in it.
        """
        heights = body @ self.axes[chosen][:, :, 2].T - self.planes[chosen]
        first, last = heights[self.edges[:, 0]], heights[self.edges[:, 1]]
        edge, piece = np.nonzero(first * last < 0)
        share = first[edge, piece] / (first[edge, piece] - last[edge, piece])
        a, b = body[self.edges[edge, 0]], body[self.edges[edge, 1]]
        points = a + share[:, None] * (b - a)
        sides = np.einsum("nej,nj->ne", self.edge_normals[chosen[piece]], points)
        inside = (sides >= self.edge_offsets[chosen[piece]] - ON_EDGE).all(axis=1)
        return points[inside], piece[inside]


def _clip_rings(rings: Array, normals: Array, offsets: Array) -> tuple[Array, IntArray]:
    """Ends (n, 3) of the edges of rings clipped by a convex body, and the edges' rings (n,).

    Args:
        rings: (p, e, 3) corners of polygons, m.
        normals: (f, 3) outward normals of the body's faces.
        offsets: (f,) offsets of the body's faces: inside where n . x + offset <= 0, m.
    """
    first, last = rings, np.roll(rings, -1, axis=1)
    here, there = (ends @ normals.T + offsets for ends in (first, last))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = here / (here - there)
    enters = np.where(here > there, np.where(here > 0, share, 0.0), 0.0).max(axis=2)
    leaves = np.where(there > here, np.where(there > 0, share, 1.0), 1.0).min(axis=2)
    outside = ((here > 0) & (there > 0)).any(axis=2)
    ring, edge = np.nonzero(~outside & (enters <= leaves))
    a, b = first[ring, edge], last[ring, edge]
    ends = [a + share[ring, edge][:, None] * (b - a) for share in (enters, leaves)]
    return np.concatenate(ends), np.concatenate([ring, ring])
