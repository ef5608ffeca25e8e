"""The contact generator (section 4.1) and the whole-body tests that its candidates must pass."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from pydantic import Field

from rbprm_core.contacts.collision import CollisionModel
from rbprm_core.contacts.heuristics import Candidates, check_names, rank
from rbprm_core.contacts.look_ahead import LookAhead
from rbprm_core.contacts.projection import project
from rbprm_core.contacts.state import Contact, State
from rbprm_core.contacts.tally import Tally
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.statics import Equilibrium, cone_generators, robustness

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GeneratorOptions:
    """Options of the contact generator.

    Attributes:
        band: samples farther than this from a surface are no candidates, metres.
        edge_margin: least distance of a contact from its surface's boundary, metres.
        candidates: most candidates that are projected for one contact.
        spacing: of the candidates on a surface, metres; of those that are nearer to each other
            only the best is tried, since what blocks one mostly blocks the other.
        move: a new contact nearer than this to the one it replaces is no move, metres.
    """

    band: Annotated[float, Field(gt=0)] = 0.04
    edge_margin: Annotated[float, Field(ge=0)] = 0.01
    candidates: Annotated[int, Field(ge=1)] = 60
    spacing: Annotated[float, Field(gt=0)] = 0.04
    move: Annotated[float, Field(ge=0.002)] = 0.02


class ContactGenerator:
    """Makes contacts for one robot in one scene. Not thread-safe: it holds scratch data.

    Args:
        gravity: (3,) m/s^2. threshold: least raw b0 of a state, newtons.
    """

    def __init__(
        self,
        data: RobotData,
        scene: Scene,
        gravity: Array,
        threshold: float,
        options: GeneratorOptions = GeneratorOptions(),
    ) -> None:
        self.robot = data.robot
        self.scene = scene
        self.threshold = threshold
        self.options = options
        self.tally = Tally()
        self.collision = CollisionModel(data, scene)
        self._gravity, self._mass = gravity, data.robot.mass
        self._data = self.robot.model.createData()
        self._databases, self._faces = data.databases, data.faces
        self._pieces = [scene.pieces(limb.surfaces) for limb in self.robot.limbs]
        for limb in self.robot.limbs:
            check_names(limb.heuristics, f"limbs.{limb.name}.heuristics")

    def generate(
        self,
        q: Array,
        limb: int,
        others: Sequence[Contact],
        ahead: LookAhead,
        *,
        replaced: Contact | None = None,
        threshold: float | None = None,
    ) -> tuple[Array, Contact, float] | str:
        """The best contact of a limb that leaves the whole body free and in equilibrium.

        Args:
            q: (nq,) configuration of the rest. others: the contacts that stand.
            replaced: contact that the new one must differ from.
            threshold: least b0 instead of the request's; minus infinity accepts any.

        Returns:
            Configuration (nq,), contact and b0, or the reason why there is none: "no candidate
            near a surface", "kinematics" or "equilibrium".
        """
        least = self.threshold if threshold is None else threshold
        reason = "no candidate near a surface"
        for trial, contact in self._placed(q, limb, ahead, replaced):
            reason = "equilibrium" if reason == "equilibrium" else "kinematics"
            with self.tally.timed("collision"):
                free = self.collision.limb_free(trial, limb, contact.normal)
            if not free:
                continue
            value = self.robustness(trial, [*others, contact])
            if value >= least:
                return trial, contact, value
            reason = "equilibrium"
        return reason

    def maintain(self, q: Array, contact: Contact) -> Array | None:
        """q with the contact's limb projected back onto it (4.2.1); None where it cannot be."""
        limb = self.robot.limbs[contact.limb]
        self._forward(q)
        base = self._data.oMi[limb.base]
        target = base.actInv(contact.position + limb.radius * contact.normal)
        with self.tally.timed("projection"):
            joints = project(limb, q[limb.q_index], target)
        if joints is None:
            return None
        moved = q.copy()
        moved[limb.q_index] = joints
        return moved

    def rest(self, q: Array, limb: int, rng: np.random.Generator) -> Array | None:
        """q with a limb that touches nothing: as it is, at reference, or at a random sample."""
        index = self.robot.limbs[limb].q_index
        database = self._databases[limb]
        draws = rng.integers(len(database.joints), size=30)
        for joints in (q[index], self.robot.reference[index], *database.joints[draws]):
            trial = q.copy()
            trial[index] = joints
            with self.tally.timed("collision"):
                free = self.collision.limb_free(trial, limb, None)
            if free:
                return trial
        return None

    def com(self, q: Array) -> Array:
        """Centre of mass (3,), metres."""
        return np.asarray(pin.centerOfMass(self.robot.model, self._data, q, False)).copy()

    def robustness(self, q: Array, contacts: Sequence[Contact]) -> float:
        """Raw b0 of a configuration on some contacts, newtons."""
        with self.tally.timed("statics"):
            if not contacts:
                return -np.inf
            points = np.array([c.position for c in contacts])
            generators = np.array([c.generators for c in contacts])
            problem = Equilibrium.of(points, generators, self.com(q), self._mass, self._gravity)
            return robustness(problem)

    def state(
        self, q: Array, contacts: Sequence[Contact], free: Sequence[int], value: float
    ) -> State:
        """The state of a configuration whose robustness is known."""
        return State(q, tuple(contacts), tuple(free), self.com(q), value)

    def _forward(self, q: Array) -> None:
        pin.forwardKinematics(self.robot.model, self._data, q)

    def _placed(
        self, q: Array, limb: int, ahead: LookAhead, replaced: Contact | None
    ) -> Iterator[tuple[Array, Contact]]:
        """Configurations with the limb on a surface, in the heuristics' order."""
        this, database = self.robot.limbs[limb], self._databases[limb]
        self._forward(q)
        base = self._data.oMi[this.base]
        rotation, translation = base.rotation.copy(), base.translation.copy()
        with self.tally.timed("candidates"):
            samples, pieces, targets = self._candidates(limb, rotation, translation)
            if replaced is not None and len(samples):
                center = replaced.position + this.radius * replaced.normal
                old = rotation.T @ (center - translation)
                apart = np.linalg.norm(targets - old, axis=1) > self.options.move
                samples, pieces, targets = samples[apart], pieces[apart], targets[apart]
            order = self._order(limb, rotation, translation, samples, pieces, targets, ahead)
        for i in order[: self.options.candidates]:
            with self.tally.timed("projection"):
                joints = project(this, database.joints[samples[i]], targets[i])
            if joints is None:
                continue
            trial = q.copy()
            trial[this.q_index] = joints
            yield trial, self._contact(limb, pieces[i], rotation @ targets[i] + translation)

    def _candidates(
        self, limb: int, rotation: Array, translation: Array
    ) -> tuple[NDArray[np.int_], NDArray[np.int_], Array]:
        """Samples near a surface, the piece they are near to, and their targets on it.

        Returns:
            (h,) samples, (h,) pieces, (h, 3) contact centres in the limb's base frame.
        """
        this, database, pieces = self.robot.limbs[limb], self._databases[limb], self._pieces[limb]
        low, high = database.box(rotation, translation)
        slack = self.options.band + this.radius
        close = ((pieces.low <= high + slack) & (pieces.high >= low - slack)).all(axis=1)
        chosen = np.flatnonzero(close)
        normals = pieces.normals[chosen] @ rotation
        offsets = pieces.offsets[chosen] - pieces.normals[chosen] @ translation + this.radius
        edge_normals = pieces.edge_normals[chosen] @ rotation
        margin = np.where(pieces.outer[chosen], self.options.edge_margin, 0.0)
        edge_offsets = pieces.edge_offsets[chosen] + margin
        edge_offsets = edge_offsets - pieces.edge_normals[chosen] @ translation
        samples, near = database.near(
            normals, offsets, edge_normals, edge_offsets, self.options.band
        )
        points = database.positions[samples]
        height = np.einsum("ij,ij->i", points, normals[near]) - offsets[near]
        return samples, chosen[near], points - height[:, None] * normals[near]

    def _order(
        self,
        limb: int,
        rotation: Array,
        translation: Array,
        samples: NDArray[np.int_],
        pieces: NDArray[np.int_],
        targets: Array,
        ahead: LookAhead,
    ) -> NDArray[np.int_]:
        """Order of the candidates, best first."""
        database = self._databases[limb]
        candidates = Candidates(
            grams=database.grams[samples],
            manipulability=database.manipulability[samples],
            normals=self._pieces[limb].normals[pieces] @ rotation,
            friction=self._pieces[limb].friction[pieces],
            centers=targets,
            nominal=rotation.T @ (self._nominal(limb, ahead) - translation),
            direction=rotation.T @ ahead.direction,
            persistence=lambda: self._persistence(
                limb, targets @ rotation.T + translation, ahead.roots
            ),
        )
        order = rank(candidates, self.robot.limbs[limb].heuristics)
        return order[_first_of_each(np.floor(targets[order] / self.options.spacing), pieces[order])]

    def _nominal(self, limb: int, ahead: LookAhead) -> Array:
        """Contact centre (3,) in the reference posture, the root in the middle of the way ahead."""
        q = self.robot.reference.copy()
        q[self.robot.root_index] = ahead.middle
        pin.framesForwardKinematics(self.robot.model, self._data, q)
        this = self.robot.limbs[limb]
        return np.asarray(self._data.oMf[this.frame].act(this.center))

    def _persistence(self, limb: int, centers: Array, roots: Array) -> Array:
        """Share (h,) of the roots ahead at which centres (h, 3) stay in the limb's workspace."""
        kept = np.zeros(len(centers))
        inside = np.ones(len(centers), dtype=bool)
        faces = self._faces[limb]
        q = self.robot.reference.copy()
        for root in roots:
            q[self.robot.root_index] = root
            self._forward(q)
            base = self._data.oMi[self.robot.limbs[limb].base]
            local = (centers - base.translation) @ base.rotation
            inside &= (local @ faces[:, :3].T + faces[:, 3] <= 0).all(axis=1)
            kept += inside
        return kept / max(len(roots), 1)

    def _contact(self, limb: int, piece: int, center: Array) -> Contact:
        pieces = self._pieces[limb]
        surface = self.scene.surfaces[pieces.surface[piece]]
        plane = surface.polygon.plane
        rotation = np.column_stack([plane.axes, plane.normal])
        return Contact(
            limb=limb,
            position=center - self.robot.limbs[limb].radius * plane.normal,
            rotation=rotation,
            generators=cone_generators(rotation, surface.friction),
            friction=surface.friction,
            surface=surface.id,
        )


def _first_of_each(cells: Array, pieces: NDArray[np.int_]) -> NDArray[np.int_]:
    """Indices of the first candidate in each cell (h, 3) of each piece (h,), in order."""
    x, y, z = (cells - cells.min(axis=0, initial=0.0)).astype(np.int64).T
    keys = ((x * (y.max(initial=0) + 1) + y) * (z.max(initial=0) + 1) + z) * (
        pieces.max(initial=0) + 1
    ) + pieces
    _, first = np.unique(keys, return_index=True)
    return np.sort(first)
