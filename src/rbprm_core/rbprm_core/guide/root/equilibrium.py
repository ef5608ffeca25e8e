"""An equilibrium criterion for P1, which the paper leaves to future work (section 7).

Contact reachability asks that each limb could touch something, not that what it touches could bear
the robot. Here every point that a required limb might touch is taken as a contact at once: if not
even all of them together hold the robot, no choice among them does. The forces that a limb can
exert over a polygon are sums of those at the polygon's corners, so that the corners of each surface
clipped by the limb's workspace are enough.
"""

from __future__ import annotations

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from rbprm_core.guide.root.placements import RootPlacements
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.limb import Limb
from rbprm_core.scene import Scene
from rbprm_core.statics import Equilibrium, cone_generators, robustness

Array = NDArray[np.float64]

ROUNDING = 1e-6  # of the weight; what a robustness may lack for rounding
ON_EDGE = 1e-9  # metres; corners shared by two edges belong to both


class EquilibriumTest:
    """A condition for static equilibrium at a root configuration. Not thread-safe.

    It is necessary as far as three things are exact that are not: the workspaces, the cones, which
    are linearised from inside, and the centre of mass, which is that of the reference posture.

    Args:
        required: names of the limbs that may bear weight. gravity: (3,) m/s^2.
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
        self._bases = RootPlacements(data.robot, bases)
        self._data = data.robot.model.createData()
        self._q = data.robot.reference.copy()

    def holds(self, root: Array) -> bool:
        """True where contacts within the limbs' workspaces could bear the robot's weight."""
        if not self._gravity.any():
            return True  # nothing to bear
        if not self._limbs:
            return False
        self._q[self._robot.root_index] = root
        com = pin.centerOfMass(self._robot.model, self._data, self._q, False)
        found = [
            limb.contacts(base)
            for limb, base in zip(self._limbs, self._bases.at(root), strict=True)
        ]
        points, cones = (np.concatenate(parts) for parts in zip(*found, strict=True))
        problem = Equilibrium.of(points, cones, com, self._mass, self._gravity)
        weight = self._mass * float(np.linalg.norm(self._gravity))
        return robustness(problem) >= -ROUNDING * weight


@dataclass(frozen=True, eq=False)
class _LimbSupport:
    """A limb's workspace and the surfaces it may use; p convex pieces of e corners at most.

    Attributes:
        workspace: (v, 3) corners of Wk, faces (f, 4) and edges (g, 2) of it, in the base frame.
        reach: of the limb's patch around its centre, metres; 0 for a ball.
        rings: (p, e, 3) corners of the pieces, the last repeated, where the limb's centre would be.
        axes: (p, 3, 3) columns t1, t2, n. cones: (p, 4, 3) generators.
        planes: (p,) n . x. edge_normals, edge_offsets: as in `Pieces`. low, high: (p, 3) boxes.
    """

    workspace: Array
    faces: Array
    edges: NDArray[np.int_]
    reach: float
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
        """What a limb may stand on in a scene."""
        pieces = scene.pieces(limb.surfaces)
        surfaces = [s for s in scene.surfaces if s.kind in limb.surfaces]
        corners = [piece for s in surfaces for piece in s.polygon.pieces]
        most = pieces.edge_offsets.shape[1]
        lifts = limb.radius * pieces.normals
        rings = [
            np.concatenate([ring, np.repeat(ring[-1:], most - len(ring), axis=0)]) + lift
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
            reach=0.0 if limb.half_size is None else float(np.linalg.norm(limb.half_size)),
            rings=np.array(rings).reshape(-1, most, 3),
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
        """Corners (n, 3) of the surfaces clipped by the workspace, and their cones (n, 4, 3)."""
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
        if self.reach > 0:  # the points that bear lie within the patch, around its centre
            spread = self.reach * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
            points = points[:, None] + spread @ np.swapaxes(self.axes[piece][:, :, :2], 1, 2)
            points, piece = points.reshape(-1, 3), np.repeat(piece, 4)
        return points, self.cones[piece]

    def _cut_edges(self, body: Array, chosen: NDArray[np.int_]) -> tuple[Array, NDArray[np.int_]]:
        """Where the workspace's edges pass through pieces: points (n, 3) and places in `chosen`."""
        heights = body @ self.axes[chosen][:, :, 2].T - self.planes[chosen]
        first, last = heights[self.edges[:, 0]], heights[self.edges[:, 1]]
        edge, piece = np.nonzero(first * last < 0)
        share = first[edge, piece] / (first[edge, piece] - last[edge, piece])
        a, b = body[self.edges[edge, 0]], body[self.edges[edge, 1]]
        points = a + share[:, None] * (b - a)
        sides = np.einsum("nej,nj->ne", self.edge_normals[chosen[piece]], points)
        inside = (sides >= self.edge_offsets[chosen[piece]] - ON_EDGE).all(axis=1)
        return points[inside], piece[inside]


def _clip_rings(rings: Array, normals: Array, offsets: Array) -> tuple[Array, NDArray[np.int_]]:
    """The ends of what a convex body leaves of the edges of rings (p, e, 3), and their rings (n,).

    Args:
        normals: (f, 3) of the body's faces. offsets: (f,), inside where n . x + offset <= 0.
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
