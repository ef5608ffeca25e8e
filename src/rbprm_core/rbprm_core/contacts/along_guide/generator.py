"""The contact generator (section 4.1) and the whole-body tests that its candidates must pass."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.body.collision import CollisionModel
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide.balance import Balance
from rbprm_core.contacts.along_guide.footholds import FootholdFinder, Footholds
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.contacts.heuristics import check_names
from rbprm_core.counters import Counters
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.projection import project, project_with_base, touch
from rbprm_core.scene import Scene
from rbprm_core.statics import GRIP_FORCE

Array = NDArray[np.float64]

DOUBT = 0.004
"""Of the weight: b0 that may be gained between the expected centre of mass and the true one, which
are a centimetre or two apart."""
TIED = 1e-6  # cubic metres; a manipulability (equation 17) that is told from rounding


class ContactGenerator:
    """Makes contacts for one robot in one scene. Not thread-safe: it holds scratch data.

    Args:
        gravity: (3,) m/s^2. threshold: least b0 of a state, newtons; without weight every state is
            in force closure too.
        rng: for heuristics that draw; one of seed 0 where None.
        grip_force: sum of the contact forces that b0 without weight is measured by, newtons.
        budget: polled at every candidate, for one contact may take seconds; None for no limit.
    """

    def __init__(
        self,
        data: RobotData,
        scene: Scene,
        gravity: Array,
        threshold: float,
        options: GeneratorOptions = GeneratorOptions(),  # noqa: B008 (frozen)
        rng: np.random.Generator | None = None,
        grip_force: float = GRIP_FORCE,
        budget: Budget | None = None,
    ) -> None:
        self._budget = Budget() if budget is None else budget
        self.robot = data.robot
        self.scene = scene
        self._stability = Stability(data.robot.mass, gravity, grip_force, threshold)
        self.threshold = self._stability.threshold
        self._doubt = DOUBT * data.robot.mass * float(np.linalg.norm(gravity))
        self.options = options
        self.counters = Counters()
        self.collision = CollisionModel(data, scene, self._budget)
        self._data = self.robot.model.createData()
        self._databases = data.databases
        self._tied = [float(own.manipulability.max()) < TIED for own in data.databases]
        self._footholds = FootholdFinder(data, scene, options, rng, gravity)
        for limb in self.robot.limbs:
            check_names(limb.heuristics, f"limbs.{limb.name}.heuristics")

    @property
    def floor(self) -> float:
        """Least b0 that is taken as a last resort: the threshold, unless asked for less."""
        return (
            min(self.threshold, self._stability.least)
            if self.options.accept_below_threshold
            else self.threshold
        )

    def generate(
        self,
        q: Array,
        limb: int,
        others: Sequence[Contact],
        ahead: LookAhead,
        *,
        replaced: Contact | None = None,
        threshold: float | None = None,
        floor: float | None = None,
    ) -> tuple[Array, Contact, float] | str:
        """The best contact of a limb that leaves the whole body free and in equilibrium.

        Args:
            q: (nq,) configuration of the rest. others: the contacts that stand.
            replaced: contact that the new one must differ from.
            threshold: least b0 instead of the request's; minus infinity accepts any.
            floor: where no candidate reaches the threshold, take the most robust one whose b0
                reaches at least this.

        Returns:
            Configuration (nq,), contact and b0, or the reason why there is none: "no candidate
            near a surface", "kinematics" or "equilibrium".
        """
        least = self.threshold if threshold is None else threshold
        reason = "no candidate near a surface"
        unsteady: list[tuple[Array, Contact, float]] = []

        def hopeless(contact: Contact, com: Array) -> bool:
            # Until one candidate has failed, this costs more than it saves.
            if not unsteady or floor is not None:
                return False
            return self._b0([*others, contact], com) < least - self._doubt

        for trial, contact in self._placed(q, limb, others, ahead, replaced, hopeless):
            reason = "kinematics"
            value = self.robustness(trial, [*others, contact])
            if value < least:
                unsteady.append((trial, contact, value))
            elif self._clear(trial, contact):
                self.counters.counts["contacts"] += 1
                return trial, contact, value
        unsteady.sort(key=lambda found: -found[2])
        best = next((found for found in unsteady if self._clear(found[0], found[1])), None)
        if best is not None:
            if floor is not None and best[2] >= floor:
                self.counters.counts["contacts"] += 1
                return best
            reason = "equilibrium"
        self.counters.counts[f"no contact: {reason}"] += 1
        return reason

    def maintain(self, q: Array, contact: Contact) -> Array | None:
        """q with the contact's limb projected back onto it (4.2.1); None where it cannot be."""
        limb = self.robot.limbs[contact.limb]
        self._forward(q)
        base = self._data.oMi[limb.base]
        target = base.actInv(contact.position + limb.radius * contact.normal)
        rotation = base.rotation.T @ contact.rotation if limb.planar else None
        with self.counters.timed("projection"):
            joints = project(limb, q[limb.q_index], target, rotation)
        if joints is None or not limb.faces(joints, base.rotation.T @ contact.normal):
            return None
        moved = q.copy()
        moved[limb.q_index] = joints
        return moved

    def follow(self, q: Array, contact: Contact, most: float) -> Array | None:
        """q with the root shifted so that a limb keeps its contact; None where it cannot be.

        Args:
            most: largest shift of the root, metres.
        """
        limb = self.robot.limbs[contact.limb]
        self._forward(q)
        base = self._data.oMi[limb.base]
        target = base.actInv(contact.position + limb.radius * contact.normal)
        rotation = base.rotation.T @ contact.rotation if limb.planar else None
        with self.counters.timed("projection"):
            found = project_with_base(limb, q[limb.q_index], target, rotation, most)
        if found is None or not limb.faces(found[0], base.rotation.T @ contact.normal):
            return None
        moved = q.copy()
        moved[limb.q_index] = found[0]
        moved[:3] += base.rotation @ found[1]
        return moved

    def tied(self, limb: int) -> bool:
        """True where a limb's joints move its contact on a surface only, as a knee's on a sphere.

        The root then cannot move freely while the contact is kept.
        """
        return self._tied[limb]

    def rest(
        self, q: Array, limb: int, rng: np.random.Generator, without: Iterable[int] = ()
    ) -> Array | None:
        """q with a limb that touches nothing: as it is, at reference, or at a random sample.

        Args:
            without: limbs that are not in its way.
        """
        index = self.robot.limbs[limb].q_index
        database = self._databases[limb]
        draws = rng.integers(len(database.joints), size=30)
        for joints in (q[index], self.robot.reference[index], *database.joints[draws]):
            trial = q.copy()
            trial[index] = joints
            self._budget.poll()
            with self.counters.timed("collision"):
                free = self.collision.limb_free(trial, limb, None, without)
            if free:
                return trial
        return None

    def com(self, q: Array) -> Array:
        """Centre of mass (3,), metres."""
        return np.asarray(pin.centerOfMass(self.robot.model, self._data, q, False)).copy()

    def robustness(self, q: Array, contacts: Sequence[Contact]) -> float:
        """b0 of a configuration on some contacts, newtons; without weight, that of the grip."""
        return self._b0(contacts, self.com(q))

    def state(
        self, q: Array, contacts: Sequence[Contact], free: Sequence[int], value: float
    ) -> State:
        """The state of a configuration whose robustness is known."""
        return State(q, tuple(contacts), tuple(free), self.com(q), value)

    def _b0(self, contacts: Sequence[Contact], com: Array) -> float:
        with self.counters.timed("statics"):
            return self._stability.b0(contacts, com)

    def _balance(self, q: Array, limb: int, base: pin.SE3) -> Balance:
        """Where the centre of mass would be with a limb as in any of its samples."""
        this = self.robot.limbs[limb]
        share = this.kinematics.mass / self.robot.mass
        now = base.act(this.kinematics.com(q[this.q_index]))
        return Balance(self.com(q) - share * now, share, base, self._databases[limb].coms)

    def _clear(self, q: Array, contact: Contact) -> bool:
        with self.counters.timed("collision"):
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
        hopeless: Callable[[Contact, Array], bool],
    ) -> Iterator[tuple[Array, Contact]]:
        """Configurations with the limb on a surface, in the heuristics' order.

        Args:
            hopeless: of a contact and the centre of mass (3,) to be expected with it; True saves
                its projection.
        """
        this, database = self.robot.limbs[limb], self._databases[limb]
        self._forward(q)
        base = self._data.oMi[this.base].copy()
        balance = self._balance(q, limb, base)
        batches = self._footholds.find(limb, base, ahead, replaced, others, balance)
        while True:
            self._budget.poll()
            with self.counters.timed("candidates"):
                found = next(batches, None)
            if found is None:
                return
            coms = balance.com(found.samples)
            for i in range(len(found)):
                self._budget.poll()
                if self.tied(limb):
                    placed = self._touching(q, limb, base, found, i)
                    if placed is not None and self._is_moved(placed[1], replaced):
                        yield placed
                    continue
                frame = pin.SE3(found.rotations[i], found.targets[i])
                contact = self._footholds.contact(limb, found.pieces[i], base * frame)
                if contact is None or hopeless(contact, coms[i]):
                    continue
                with self.counters.timed("projection"):
                    start = database.joints[found.samples[i]]
                    turn = frame.rotation if this.planar else None
                    joints = project(this, start, frame.translation, turn)
                if joints is not None and this.faces(joints, found.normals[i]):
                    trial = q.copy()
                    trial[this.q_index] = joints
                    yield trial, contact

    def _touching(
        self, q: Array, limb: int, base: pin.SE3, found: Footholds, i: int
    ) -> tuple[Array, Contact] | None:
        """Configuration and contact of a tied limb where it meets the surface of a foothold.

        Beside the foothold: no joints put such a limb on a given point.
        """
        this, normal = self.robot.limbs[limb], found.normals[i]
        with self.counters.timed("projection"):
            start = self._databases[limb].joints[found.samples[i]]
            joints = touch(this, start, normal, float(normal @ found.targets[i]))
        if joints is None or not this.faces(joints, normal):
            return None
        center = this.kinematics.position_and_jacobian(joints)[0]
        frame = pin.SE3(found.rotations[i], center)
        contact = self._footholds.contact(limb, found.pieces[i], base * frame)
        if contact is None or not self._footholds.holds(limb, found.pieces[i], contact.position):
            return None
        trial = q.copy()
        trial[this.q_index] = joints
        return trial, contact

    def _is_moved(self, contact: Contact, replaced: Contact | None) -> bool:
        """True where a contact is not where the one it replaces was."""
        if replaced is None:
            return True
        moved = float(np.linalg.norm(contact.position - replaced.position))
        return moved > self.options.move
