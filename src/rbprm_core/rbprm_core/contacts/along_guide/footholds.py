"""Places on surfaces where a limb could make contact: from its samples, before any projection."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import shapely

from rbprm_core.arrays import Array, BoolArray, IntArray
from rbprm_core.body.contact import Contact
from rbprm_core.contacts.along_guide.balance import Balance
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.contacts.heuristics import Candidates, rank
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface
from rbprm_core.statics import cone_generators

DOWN = np.array([0.0, 0.0, -1.0])

FIRST_BATCH = 64
"""Candidates of the first batch; about three of four are too near to a better one."""


@dataclass(frozen=True, eq=False)
class Footholds:
    """h candidate contacts of one limb, in the frame of its base joint.

    Attributes:
        samples: (h,) indices of the limb samples that they come from.
        pieces: (h,) indices of the convex pieces of the surfaces that they lie on.
        targets: (h, 3) origin of the contact frame, metres.
        normals: (h, 3) outward unit normals of the surfaces.
        rotations: (h, 3, 3) contact frames: that of the sample, and for a patch finally rotated by
            the smallest angle onto the surface.
    """

    samples: IntArray
    pieces: IntArray
    targets: Array
    normals: Array
    rotations: Array

    def __getitem__(self, index: IntArray | BoolArray) -> Footholds:
        # Rows by `take`: an index in brackets takes four times as long.
        rows = np.flatnonzero(index) if index.dtype == bool else index
        return Footholds(
            self.samples[rows],
            self.pieces[rows],
            self.targets.take(rows, axis=0),
            self.normals.take(rows, axis=0),
            self.rotations.take(rows, axis=0),
        )

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def cosines(self) -> Array:
        """Cosines (h,) of the angles between the z axes of the contact frames and the normals."""
        return np.asarray(np.einsum("ij,ij->i", self.rotations[:, :, 2], self.normals))


class FootholdFinder:
    """Finds candidate contacts of one robot in one scene, before any projection.

    Tonneau et al. 2018, section 4.1. Not thread-safe: it holds scratch data.

    Args:
        data: the robot with its sample databases.
        scene: the environment.
        options: options of the contact generator.
        rng: random generator for heuristics that draw; one of seed 0 where None.
        gravity: (3,) gravity in the planning frame, m/s^2.
    """

    def __init__(
        self,
        data: RobotData,
        scene: Scene,
        options: GeneratorOptions,
        rng: np.random.Generator | None = None,
        gravity: Array = DOWN,
    ) -> None:
        self._robot, self._scene, self._options = data.robot, scene, options
        self._rng = np.random.default_rng(0) if rng is None else rng
        self._databases, self._faces = data.databases, data.faces
        self._pieces = [scene.pieces(limb.surfaces) for limb in data.robot.limbs]
        self._data = data.robot.model.createData()
        self._cones: dict[str, tuple[Array, Array]] = {}
        self._level = _level_axes(gravity)

    def find(
        self,
        limb: int,
        base: pin.SE3,
        ahead: LookAhead,
        replaced: Contact | None,
        others: Sequence[Contact],
        balance: Balance,
    ) -> Iterator[Footholds]:
        """Footholds within a limb's reach in batches, best first; the first batch mostly suffices.

        They are in the heuristics' order, except that those that leave the centre of mass outside
        of the support polygon come last: on nearly level ground the equilibrium test would refuse
        them, after a projection each.

        Args:
            limb: index of the limb.
            base: placement of the limb's base joint in the planning frame.
            ahead: what lies ahead on the guide.
            replaced: contact from which all footholds must be apart, None where there is none.
            others: contacts of the other limbs.
            balance: centre of mass with the limb as in any of its samples.
        """
        rotation, translation = base.rotation, base.translation
        found = self._near(limb, rotation, translation)
        if self._robot.limbs[limb].planar:
            found = found[found.cosines > np.cos(self._options.tilt)]
        elif self._robot.limbs[limb].min_cosine > -1:
            found = found[found.cosines >= self._robot.limbs[limb].min_cosine]
        if replaced is not None:
            center = replaced.position + self._robot.limbs[limb].radius * replaced.normal
            old = rotation.T @ (center - translation)
            found = found[np.linalg.norm(found.targets - old, axis=1) > self._options.move]
        order = rank(
            self._candidates(limb, found, rotation, translation, ahead),
            self._robot.limbs[limb].heuristics,
        )
        yield from self._spread(limb, found, order, base, others, balance)

    def _spread(
        self,
        limb: int,
        found: Footholds,
        order: IntArray,
        base: pin.SE3,
        others: Sequence[Contact],
        balance: Balance,
    ) -> Iterator[Footholds]:
        """The first footholds of an order that are apart from each other, balanced ones first.

        The order is evaluated only as far as batches are consumed, since most of it is never
        tried.
        """
        limit, this = self._options.candidates, self._robot.limbs[limb]
        standing = np.concatenate([np.zeros((0, 3)), *(c.points for c in others)])
        count, yielded = FIRST_BATCH, 0
        while True:
            first = found[order[:count]]
            if this.planar:
                first = self._turned_onto(limb, first, base)
            cells = np.floor(first.targets / self._options.spacing)
            first = first[_first_of_each(cells, first.pieces)]
            centers = first.targets @ base.rotation.T + base.translation
            turned = np.swapaxes(base.rotation @ first.rotations, 1, 2)
            points = centers[:, None] + this.corners @ turned
            com = balance.com(first.samples)
            balanced = _over_support(*(part @ self._level for part in (points, standing, com)))
            chosen = np.flatnonzero(balanced)[:limit]
            if count >= len(order):
                chosen = np.concatenate([chosen, np.flatnonzero(~balanced)])[:limit]
            # A larger batch begins with the footholds of the smaller one.
            if len(chosen) > yielded:
                yield first[chosen[yielded:]]
            if len(chosen) == limit or count >= len(order):
                return
            yielded = len(chosen)
            count *= 4

    def contact(self, limb: int, piece: int, frame: pin.SE3) -> Contact | None:
        """The contact of a limb on a piece; None where a patch overhangs its surface.

        Args:
            limb: index of the limb.
            piece: index of the piece.
            frame: contact frame in the planning frame, its origin the centre of the ball or patch.
        """
        this, surface = self._robot.limbs[limb], self._surface(limb, piece)
        plane = surface.polygon.plane
        position = frame.translation - this.radius * plane.normal
        if not this.planar:
            rotation, rays = self._ball_cone(surface)
            return Contact(
                limb, position, rotation, position[None], rays, surface.friction, surface.id
            )
        rotation = frame.rotation
        points = position + this.corners @ rotation.T
        if len(surface.polygon.pieces) > 1:
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

    def holds(self, limb: int, piece: int, point: Array) -> bool:
        """True where a point is on the surface of a piece, farther from its edge than the margin.

        Args:
            limb: index of the limb.
            piece: index of the piece.
            point: (3,) point of the piece's plane in the planning frame, metres.
        """
        polygon = self._surface(limb, piece).polygon
        place = shapely.Point(polygon.plane.flatten(point[None])[0])
        return bool(polygon.shrunk(self._options.edge_margin).covers(place))

    def _ball_cone(self, surface: Surface) -> tuple[Array, Array]:
        """Contact frame (3, 3) and cone generators (1, 4, 3) of a ball anywhere on a surface."""
        if surface.id not in self._cones:
            plane = surface.polygon.plane
            upright = np.column_stack([plane.axes, plane.normal])
            self._cones[surface.id] = (upright, cone_generators(upright, surface.friction)[None])
        return self._cones[surface.id]

    def _surface(self, limb: int, piece: int) -> Surface:
        return self._scene.surfaces[int(self._pieces[limb].surface[piece])]

    def _near(self, limb: int, rotation: Array, translation: Array) -> Footholds:
        """Footholds from the samples within the band of a surface and over its outline."""
        this, database, pieces = self._robot.limbs[limb], self._databases[limb], self._pieces[limb]
        low, high = database.box(rotation, translation)
        slack = self._options.band + this.radius
        close = ((pieces.low <= high + slack) & (pieces.high >= low - slack)).all(axis=1)
        chosen = np.flatnonzero(close)
        normals = pieces.normals[chosen] @ rotation
        offsets = pieces.offsets[chosen] - pieces.normals[chosen] @ translation + this.radius
        edge_normals = pieces.edge_normals[chosen] @ rotation
        half = 0.0 if this.half_size is None else float(this.half_size.min())
        min_margin = self._options.edge_margin + half
        margin = np.where(pieces.outer[chosen], min_margin, 0.0)
        edge_offsets = pieces.edge_offsets[chosen] + margin
        edge_offsets = edge_offsets - pieces.edge_normals[chosen] @ translation
        samples, near = database.near(
            normals, offsets, edge_normals, edge_offsets, self._options.band
        )
        points, facing = database.positions.take(samples, axis=0), normals.take(near, axis=0)
        height = np.einsum("ij,ij->i", points, facing) - offsets[near]
        return Footholds(
            samples=samples,
            pieces=chosen[near],
            targets=points - height[:, None] * facing,
            normals=facing,
            rotations=database.rotations.take(samples, axis=0),
        )

    def _turned_onto(self, limb: int, found: Footholds, base: pin.SE3) -> Footholds:
        r"""Footholds of a patch rotated onto their surfaces, where the whole patch lies on them.

        Along the normal e of an edge the patch extends
        $|e \cdot t_1| h_x + |e \cdot t_2| h_y$ from its middle.
        """
        turned = _turned(found.rotations, found.normals, found.cosines)
        found = replace(found, rotations=turned)
        pieces, half = self._pieces[limb], self._robot.limbs[limb].half_size
        assert half is not None  # the limb is planar
        edge_normals = pieces.edge_normals[found.pieces]
        edges = edge_normals @ base.rotation
        offsets = pieces.edge_offsets[found.pieces] - edge_normals @ base.translation
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
        """The footholds as input of the heuristics."""
        database, this = self._databases[limb], self._robot.limbs[limb]
        return Candidates(
            joints=database.joints.take(found.samples, axis=0),
            reference=self._robot.reference[this.q_index],
            low=this.low,
            high=this.high,
            grams=database.grams.take(found.samples, axis=0),
            manipulability=database.manipulability[found.samples],
            normals=found.normals,
            friction=self._pieces[limb].friction[found.pieces],
            centers=found.targets,
            nominal=rotation.T @ (self._nominal(limb, ahead) - translation),
            direction=rotation.T @ ahead.direction,
            persistence=lambda: self._persistence(
                limb, found.targets @ rotation.T + translation, ahead.roots
            ),
            rng=self._rng,
        )

    def _nominal(self, limb: int, ahead: LookAhead) -> Array:
        """Contact centre (3,) in the reference posture at the middle of the guide ahead, metres."""
        q = self._robot.reference.copy()
        q[self._robot.root_index] = ahead.middle
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        this = self._robot.limbs[limb]
        return np.asarray(self._data.oMf[this.frame].act(this.contact.translation))

    def _persistence(self, limb: int, centers: Array, roots: Array) -> Array:
        """Share (h,) of the roots ahead at which contact centres (h, 3) stay in the workspace."""
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


def _level_axes(gravity: Array) -> Array:
    """Unit columns (3, 2) perpendicular to gravity (3,); (3, 0) without gravity."""
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return np.zeros((3, 0))
    return np.asarray(np.linalg.svd(gravity[None] / size)[2][1:].T)


def _over_support(points: Array, standing: Array, com: Array) -> BoolArray:
    """True (h,) where a centre of mass lies in the support polygon; everywhere without gravity.

    Seen from a point inside a convex hull, corners lie in every half plane: no gap between the
    directions to them reaches half a turn.

    Args:
        points: (h, k, 2) points of the new contact in level coordinates, metres.
        standing: (s, 2) points of the other contacts, metres.
        com: (h, 2) centres of mass, metres.
    """
    fixed = np.broadcast_to(standing, (len(points), *standing.shape))
    if com.size == 0:
        return np.ones(len(points), dtype=bool)
    arms = np.concatenate([points, fixed], axis=1) - com[:, None]
    angles = np.sort(np.arctan2(arms[..., 1], arms[..., 0]), axis=1)
    gaps = np.diff(angles, axis=1, append=angles[:, :1] + 2 * np.pi)
    return np.asarray((gaps < np.pi).all(axis=1))


def _turned(rotations: Array, normals: Array, cosine: Array) -> Array:
    """Rotations (h, 3, 3) turned by the smallest angle so that their z axes are the normals."""
    cross = np.cross(rotations[:, :, 2], normals)
    skew = np.zeros((len(cross), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -cross[:, 2], cross[:, 1], -cross[:, 0]
    skew -= np.swapaxes(skew, 1, 2)
    return np.asarray((np.eye(3) + skew + skew @ skew / (1 + cosine)[:, None, None]) @ rotations)


def _first_of_each(cells: Array, pieces: IntArray) -> IntArray:
    """Indices of the first foothold in each cell (h, 3) of each piece (h,), in order."""
    x, y, z = (cells - cells.min(axis=0, initial=0.0)).astype(np.int64).T
    keys = ((x * (y.max(initial=0) + 1) + y) * (z.max(initial=0) + 1) + z) * (
        pieces.max(initial=0) + 1
    ) + pieces
    _, first = np.unique(keys, return_index=True)
    return np.sort(first)
