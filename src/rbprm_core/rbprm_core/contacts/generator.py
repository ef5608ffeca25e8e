"""The contact generator (section 4.1) and the whole-body tests that its candidates must pass."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.contacts.collision import CollisionModel
from rbprm_core.contacts.footholds import FootholdFinder
from rbprm_core.contacts.heuristics import check_names
from rbprm_core.contacts.look_ahead import LookAhead
from rbprm_core.contacts.options import GeneratorOptions
from rbprm_core.contacts.state import Contact, State
from rbprm_core.contacts.tally import Tally
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.projection import project
from rbprm_core.scene import Scene
from rbprm_core.statics import Equilibrium, robustness

Array = NDArray[np.float64]


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
        options: GeneratorOptions = GeneratorOptions(),  # noqa: B008 (frozen)
    ) -> None:
        self.robot = data.robot
        self.scene = scene
        self.threshold = threshold
        self.options = options
        self.tally = Tally()
        self.collision = CollisionModel(data, scene)
        self._gravity, self._mass = gravity, data.robot.mass
        self._data = self.robot.model.createData()
        self._databases = data.databases
        self._footholds = FootholdFinder(data, scene, options)
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
        unsteady = []
        for trial, contact in self._placed(q, limb, others, ahead, replaced):
            reason = "kinematics"
            value = self.robustness(trial, [*others, contact])
            if value < least:
                unsteady.append((trial, contact))
            elif self._clear(trial, contact):
                return trial, contact, value
        if any(self._clear(trial, contact) for trial, contact in unsteady):
            return "equilibrium"
        return reason

    def maintain(self, q: Array, contact: Contact) -> Array | None:
        """q with the contact's limb projected back onto it (4.2.1); None where it cannot be."""
        limb = self.robot.limbs[contact.limb]
        self._forward(q)
        base = self._data.oMi[limb.base]
        target = base.actInv(contact.position + limb.radius * contact.normal)
        rotation = base.rotation.T @ contact.rotation if limb.planar else None
        with self.tally.timed("projection"):
            joints = project(limb, q[limb.q_index], target, rotation)
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
            points = np.concatenate([c.points for c in contacts])
            generators = np.concatenate([c.generators for c in contacts])
            problem = Equilibrium.of(points, generators, self.com(q), self._mass, self._gravity)
            return robustness(problem)

    def state(
        self, q: Array, contacts: Sequence[Contact], free: Sequence[int], value: float
    ) -> State:
        """The state of a configuration whose robustness is known."""
        return State(q, tuple(contacts), tuple(free), self.com(q), value)

    def _clear(self, q: Array, contact: Contact) -> bool:
        with self.tally.timed("collision"):
            return self.collision.limb_free(q, contact.limb, contact.normal)

    def _forward(self, q: Array) -> None:
        pin.forwardKinematics(self.robot.model, self._data, q)

    def _placed(
        self,
        q: Array,
        limb: int,
        others: Sequence[Contact],
        ahead: LookAhead,
        replaced: Contact | None,
    ) -> Iterator[tuple[Array, Contact]]:
        """Configurations with the limb on a surface, in the heuristics' order."""
        this, database = self.robot.limbs[limb], self._databases[limb]
        self._forward(q)
        base = self._data.oMi[this.base].copy()
        with self.tally.timed("candidates"):
            found = self._footholds.find(limb, base, ahead, replaced, others, self.com(q))
        for i in range(min(len(found), self.options.candidates)):
            frame = pin.SE3(found.rotations[i], found.targets[i])
            contact = self._footholds.contact(limb, found.pieces[i], base * frame)
            if contact is None:
                continue
            with self.tally.timed("projection"):
                start = database.joints[found.samples[i]]
                turn = frame.rotation if this.planar else None
                joints = project(this, start, frame.translation, turn)
            if joints is not None:
                trial = q.copy()
                trial[this.q_index] = joints
                yield trial, contact
