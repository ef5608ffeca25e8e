"""Places on surfaces where a limb could make contact: from its samples, before any projection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import shapely
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics import Candidates, rank
from rbprm_core.contacts.look_ahead import LookAhead
from rbprm_core.contacts.options import GeneratorOptions
from rbprm_core.contacts.state import Contact
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface
from rbprm_core.statics import cone_generators

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Footholds:
    """h places for one limb, in its base frame.

    Attributes:
        samples: (h,) indices of the samples that are near. pieces: (h,) of the surfaces' pieces.
        targets: (h, 3) where the contact frame's origin has to be, metres.
        normals: (h, 3) of the surfaces.
        rotations: (h, 3, 3) of the contact frame there: the sample's, turned by the least angle
            onto the surface.
    """

    samples: NDArray[np.int_]
    pieces: NDArray[np.int_]
    targets: Array
    normals: Array
    rotations: Array

    def __getitem__(self, index: NDArray[np.int_] | NDArray[np.bool_]) -> Footholds:
        return Footholds(
            self.samples[index],
            self.pieces[index],
            self.targets[index],
            self.normals[index],
            self.rotations[index],
        )

    def __len__(self) -> int:
        return len(self.samples)


class FootholdFinder:
    """Finds footholds of one robot in one scene. Not thread-safe: it holds scratch data."""

    def __init__(self, data: RobotData, scene: Scene, options: GeneratorOptions) -> None:
        self._robot, self._scene, self._options = data.robot, scene, options
        self._databases, self._faces = data.databases, data.faces
        self._pieces = [scene.pieces(limb.surfaces) for limb in data.robot.limbs]
        self._data = data.robot.model.createData()

    def find(
        self,
        limb: int,
        base: pin.SE3,
        ahead: LookAhead,
        replaced: Contact | None,
        others: Sequence[Contact],
        com: Array,
    ) -> Footholds:
        """Footholds within a limb's reach, best first.

        The heuristics' order, but those that leave the centre of mass outside the support area
        come last: on rather level ground the equilibrium problem would refuse them, at the price
        of a projection each.

        Args:
            base: placement of the limb's base. replaced: contact that all must be apart from.
            others: the contacts that stand. com: (3,) centre of mass as far as it is known, metres.
        """
        rotation, translation = base.rotation, base.translation
        found = self._near(limb, rotation, translation)
        if self._robot.limbs[limb].planar:
            found = self._facing(limb, found, translation, rotation)
        if replaced is not None:
            center = replaced.position + self._robot.limbs[limb].radius * replaced.normal
            old = rotation.T @ (center - translation)
            found = found[np.linalg.norm(found.targets - old, axis=1) > self._options.move]
        order = rank(
            self._candidates(limb, found, rotation, translation, ahead),
            self._robot.limbs[limb].heuristics,
        )
        cells = np.floor(found.targets[order] / self._options.spacing)
        found = found[order[_first_of_each(cells, found.pieces[order])]]
        centers = found.targets @ rotation.T + translation
        corners = self._robot.limbs[limb].corners
        points = centers[:, None] + corners @ np.swapaxes(rotation @ found.rotations, 1, 2)
        standing = np.concatenate([np.zeros((0, 3)), *(c.points for c in others)])
        steady = _over_support(points, standing, com)
        return found[np.concatenate([np.flatnonzero(steady), np.flatnonzero(~steady)])]

    def contact(self, limb: int, piece: int, frame: pin.SE3) -> Contact | None:
        """The contact of a limb whose contact frame (ball centre) is placed on a piece.

        Returns:
            None where a patch does not lie on the surface as a whole.
        """
        this, surface = self._robot.limbs[limb], self._surface(limb, piece)
        plane = surface.polygon.plane
        position = frame.translation - this.radius * plane.normal
        upright = np.column_stack([plane.axes, plane.normal])
        rotation = frame.rotation if this.planar else upright
        points = position + this.corners @ rotation.T
        if this.planar and len(surface.polygon.pieces) > 1:
            # On a convex surface the edges were tested on arrays already.
            patch = shapely.Polygon(plane.flatten(points))
            if not surface.polygon.shrunk(self._options.edge_margin).covers(patch):
                return None
        rays = cone_generators(rotation, surface.friction)
        return Contact(
            limb=limb,
            position=position,
            rotation=rotation,
            points=points,
            generators=np.broadcast_to(rays, (len(points), 4, 3)),
            friction=surface.friction,
            surface=surface.id,
        )

    def _surface(self, limb: int, piece: int) -> Surface:
        return self._scene.surfaces[int(self._pieces[limb].surface[piece])]

    def _near(self, limb: int, rotation: Array, translation: Array) -> Footholds:
        """Footholds from samples within the band of a surface and over it."""
        this, database, pieces = self._robot.limbs[limb], self._databases[limb], self._pieces[limb]
        low, high = database.box(rotation, translation)
        slack = self._options.band + this.radius
        close = ((pieces.low <= high + slack) & (pieces.high >= low - slack)).all(axis=1)
        chosen = np.flatnonzero(close)
        normals = pieces.normals[chosen] @ rotation
        offsets = pieces.offsets[chosen] - pieces.normals[chosen] @ translation + this.radius
        edge_normals = pieces.edge_normals[chosen] @ rotation
        margin = np.where(pieces.outer[chosen], self._options.edge_margin, 0.0)
        edge_offsets = pieces.edge_offsets[chosen] + margin
        edge_offsets = edge_offsets - pieces.edge_normals[chosen] @ translation
        samples, near = database.near(
            normals, offsets, edge_normals, edge_offsets, self._options.band
        )
        points, facing = database.positions[samples], normals[near]
        height = np.einsum("ij,ij->i", points, facing) - offsets[near]
        return Footholds(
            samples=samples,
            pieces=chosen[near],
            targets=points - height[:, None] * facing,
            normals=facing,
            rotations=database.rotations[samples],
        )

    def _facing(
        self, limb: int, found: Footholds, translation: Array, rotation: Array
    ) -> Footholds:
        """Footholds of a patch: samples that nearly face the surface, turned onto it.

        The whole patch has to lie inside the surface's boundary: along an edge's normal e it
        reaches |e . t1| hx + |e . t2| hy from its middle.
        """
        axis = found.rotations[:, :, 2]
        cosine = np.einsum("ij,ij->i", axis, found.normals)
        facing = cosine > np.cos(self._options.tilt)
        found, cosine = found[facing], cosine[facing]
        turned = _turned(found.rotations, found.normals, cosine)
        found = Footholds(found.samples, found.pieces, found.targets, found.normals, turned)
        pieces, half = self._pieces[limb], self._robot.limbs[limb].half_size
        assert half is not None  # the limb is planar
        edges = pieces.edge_normals[found.pieces] @ rotation
        offsets = (
            pieces.edge_offsets[found.pieces] - pieces.edge_normals[found.pieces] @ translation
        )
        extent = np.abs(edges @ turned[:, :, :2]) @ half + self._options.edge_margin
        inside = np.einsum("ijk,ik->ij", edges, found.targets) - offsets
        outer = pieces.outer[found.pieces]
        return found[((inside >= extent) | ~outer).all(axis=1)]

    def _candidates(
        self,
        limb: int,
        found: Footholds,
        rotation: Array,
        translation: Array,
        ahead: LookAhead,
    ) -> Candidates:
        """What the heuristics look at."""
        database = self._databases[limb]
        return Candidates(
            grams=database.grams[found.samples],
            manipulability=database.manipulability[found.samples],
            normals=found.normals,
            friction=self._pieces[limb].friction[found.pieces],
            centers=found.targets,
            nominal=rotation.T @ (self._nominal(limb, ahead) - translation),
            direction=rotation.T @ ahead.direction,
            persistence=lambda: self._persistence(
                limb, found.targets @ rotation.T + translation, ahead.roots
            ),
        )

    def _nominal(self, limb: int, ahead: LookAhead) -> Array:
        """Contact centre (3,) in the reference posture, the root in the middle of the way ahead."""
        q = self._robot.reference.copy()
        q[self._robot.root_index] = ahead.middle
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        this = self._robot.limbs[limb]
        return np.asarray(self._data.oMf[this.frame].act(this.contact.translation))

    def _persistence(self, limb: int, centers: Array, roots: Array) -> Array:
        """Share (h,) of the roots ahead at which centres (h, 3) stay in the limb's workspace."""
        kept = np.zeros(len(centers))
        inside = np.ones(len(centers), dtype=bool)
        faces = self._faces[limb]
        q = self._robot.reference.copy()
        for root in roots:
            q[self._robot.root_index] = root
            pin.forwardKinematics(self._robot.model, self._data, q)
            base = self._data.oMi[self._robot.limbs[limb].base]
            local = (centers - base.translation) @ base.rotation
            inside &= (local @ faces[:, :3].T + faces[:, 3] <= 0).all(axis=1)
            kept += inside
        return kept / max(len(roots), 1)


def _over_support(points: Array, standing: Array, com: Array) -> NDArray[np.bool_]:
    """(h,) True where the centre of mass is over the hull of points (h, k, 3) and others (s, 3).

    Seen from a point inside a hull, corners lie in every half plane: no gap between directions to
    them reaches half a turn.
    """
    fixed = np.broadcast_to(standing, (len(points), *standing.shape))
    arms = np.concatenate([points, fixed], axis=1)[..., :2] - com[:2]
    angles = np.sort(np.arctan2(arms[..., 1], arms[..., 0]), axis=1)
    gaps = np.diff(angles, axis=1, append=angles[:, :1] + 2 * np.pi)
    return np.asarray((gaps < np.pi).all(axis=1))


def _turned(rotations: Array, normals: Array, cosine: Array) -> Array:
    """Rotations (h, 3, 3) turned by the least angle so that their z axes are the normals (h, 3)."""
    cross = np.cross(rotations[:, :, 2], normals)
    skew = np.zeros((len(cross), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -cross[:, 2], cross[:, 1], -cross[:, 0]
    skew -= np.swapaxes(skew, 1, 2)
    return np.asarray((np.eye(3) + skew + skew @ skew / (1 + cosine)[:, None, None]) @ rotations)


def _first_of_each(cells: Array, pieces: NDArray[np.int_]) -> NDArray[np.int_]:
    """Indices of the first foothold in each cell (h, 3) of each piece (h,), in order."""
    x, y, z = (cells - cells.min(axis=0, initial=0.0)).astype(np.int64).T
    keys = ((x * (y.max(initial=0) + 1) + y) * (z.max(initial=0) + 1) + z) * (
        pieces.max(initial=0) + 1
    ) + pieces
    _, first = np.unique(keys, return_index=True)
    return np.sort(first)
