"""The contact generator: contacts of one limb that leave the whole robot in a valid state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.whole_body import WholeBody
from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide.balance import Balance
from rbprm_core.contacts.along_guide.footholds import FootholdFinder, Footholds
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.contacts.along_guide.walk_state import WalkState
from rbprm_core.contacts.heuristics import check_names
from rbprm_core.counters import CONTACTS_FOUND, no_contact
from rbprm_core.failures import Cause
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.projection import project, touch
from rbprm_core.scene import Scene
from rbprm_core.statics import GRIP_FORCE

COM_MARGIN = 0.004
"""Margin on b0, as a share of the weight, for the error of the predicted centre of mass.

The prediction is a centimetre or two from the true centre of mass.
"""
RESTS = 30  # random postures tried for a limb without contact


@dataclass(frozen=True, eq=False)
class Placed:
    """A limb placed on a surface.

    Attributes:
        q: (nq,) configuration of the robot.
        contact: the new contact.
        robustness: b0 with the new contact, newtons.
    """

    q: Array
    contact: Contact
    robustness: float


class ContactGenerator:
    """Makes contacts for one robot in one scene (Tonneau et al. 2018, section 4.1).

    Not thread-safe: it holds scratch data.

    Args:
        data: the robot with its precomputed data.
        scene: the environment.
        gravity: (3,) gravity in the planning frame, m/s^2.
        threshold: b0 that the request asks of every state, newtons; without weight every state is
            in force closure too.
        options: options of the generator.
        rng: random generator for heuristics that draw; one of seed 0 where None.
        grip_force: sum of the contact forces by which b0 without weight is measured, newtons.
        budget: polled at every candidate, since one contact may take seconds; None for no limit.

    Attributes:
        robot: the robot.
        body: whole-body queries of the robot in the scene.
        options: options of the generator.
        counters: counts and seconds of the operations.
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
        self.robot, self.options = data.robot, options
        self.body = WholeBody(data, scene, gravity, threshold, grip_force, self._budget)
        self.counters = self.body.counters
        self._com_margin = COM_MARGIN * data.robot.mass * float(np.linalg.norm(gravity))
        self._databases = data.databases
        self._footholds = FootholdFinder(data, scene, options, rng, gravity)
        for limb in self.robot.limbs:
            check_names(limb.heuristics, f"limbs.{limb.name}.heuristics")

    @property
    def min_robustness(self) -> float:
        """b0 that every state must reach, newtons."""
        return self.body.min_robustness

    @property
    def fallback_robustness(self) -> float:
        """b0 that is accepted as a last resort, newtons.

        `min_robustness`, or less with the option `accept_below_threshold`.
        """
        if self.options.accept_below_threshold:
            return min(self.min_robustness, self.body.stability.min_equilibrium)
        return self.min_robustness

    def generate(
        self,
        q: Array,
        limb: int,
        others: Sequence[Contact],
        ahead: LookAhead,
        *,
        replaced: Contact | None = None,
        min_robustness: float | None = None,
        fallback: float | None = None,
    ) -> Placed | Cause:
        """The best contact of a limb with the robot free of collision and in equilibrium.

        Args:
            q: (nq,) configuration of the rest of the robot.
            limb: index of the limb.
            others: contacts of the other limbs.
            ahead: what lies ahead on the guide, for the heuristics.
            replaced: contact from which the new one must differ.
            min_robustness: b0 to reach, newtons, instead of the request's; minus infinity accepts
                any.
            fallback: where no candidate reaches `min_robustness`, the one with the largest b0 is
                taken if it reaches this, newtons; None to take none.

        Returns:
            The limb placed on a surface, or why it finds none: one of
            `rbprm_core.failures.CONTACT_CAUSES`.
        """
        minimum = self.min_robustness if min_robustness is None else min_robustness
        cause = Cause.NO_CANDIDATE
        weak: list[Placed] = []

        def hopeless(contact: Contact, com: Array) -> bool:
            # Until one candidate has failed, this costs more than it saves.
            if not weak or fallback is not None:
                return False
            return self.body.b0([*others, contact], com) < minimum - self._com_margin

        for trial, contact in self._placed(q, limb, others, ahead, replaced, hopeless):
            cause = Cause.NO_KINEMATIC_SOLUTION
            value = self.body.robustness(trial, [*others, contact])
            if value < minimum:
                weak.append(Placed(trial, contact, value))
            elif self._is_free(trial, contact):
                self.counters.counts[CONTACTS_FOUND] += 1
                return Placed(trial, contact, value)
        weak.sort(key=lambda found: -found.robustness)
        best = next((found for found in weak if self._is_free(found.q, found.contact)), None)
        if best is not None:
            if fallback is not None and best.robustness >= fallback:
                self.counters.counts[CONTACTS_FOUND] += 1
                return best
            cause = Cause.NO_EQUILIBRIUM
        self.counters.counts[no_contact(cause)] += 1
        return cause

    def rest(
        self, q: Array, limb: int, rng: np.random.Generator, ignored: Iterable[int] = ()
    ) -> Array | None:
        """The configuration (nq,) with a limb that touches nothing, None where none is found.

        The limb's posture is the present one, the reference posture, or a random sample.

        Args:
            q: (nq,) configuration.
            limb: index of the limb.
            rng: random generator.
            ignored: indices of limbs that are not tested against.
        """
        index = self.robot.limbs[limb].q_index
        database = self._databases[limb]
        draws = rng.integers(len(database.joints), size=RESTS)
        for joints in (q[index], self.robot.reference[index], *database.joints[draws]):
            trial = q.copy()
            trial[index] = joints
            self._budget.poll()
            if self.body.limb_is_free(trial, limb, None, ignored):
                return trial
        return None

    def state(
        self, q: Array, contacts: Sequence[Contact], free: Sequence[int], robustness: float
    ) -> WalkState:
        """The state of a configuration whose robustness is known.

        Args:
            q: (nq,) configuration.
            contacts: contacts, oldest first.
            free: indices of the limbs without contact, free for the longest time first.
            robustness: raw b0, newtons.
        """
        return WalkState(q, tuple(contacts), self.body.com(q), robustness, tuple(free))

    def _balance(self, q: Array, limb: int, base: pin.SE3) -> Balance:
        """The centre of mass with a limb as in any of its samples."""
        this = self.robot.limbs[limb]
        share = this.kinematics.mass / self.robot.mass
        now = base.act(this.kinematics.com(q[this.q_index]))
        return Balance(self.body.com(q) - share * now, share, base, self._databases[limb].coms)

    def _is_free(self, q: Array, contact: Contact) -> bool:
        return self.body.limb_is_free(q, contact.limb, contact.normal)

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
            hopeless: called with a contact and the predicted centre of mass (3,); True saves the
                projection of the candidate.
        """
        base = self.body.base(q, limb).copy()
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
                if self.body.moves_on_surface_only(limb):
                    placed = self._touching(q, limb, base, found, i)
                    if placed is not None and self._is_moved(placed[1], replaced):
                        yield placed
                    continue
                frame = pin.SE3(found.rotations[i], found.targets[i])
                contact = self._footholds.contact(limb, found.pieces[i], base * frame)
                if contact is None or hopeless(contact, coms[i]):
                    continue
                trial = self._projected(q, limb, found, i)
                if trial is not None:
                    yield trial, contact

    def _projected(self, q: Array, limb: int, found: Footholds, i: int) -> Array | None:
        """The configuration with the limb's contact frame at a foothold, None out of reach."""
        this = self.robot.limbs[limb]
        with self.counters.timed("projection"):
            start = self._databases[limb].joints[found.samples[i]]
            rotation = found.rotations[i] if this.planar else None
            joints = project(this, start, found.targets[i], rotation)
        if joints is None or not this.faces(joints, found.normals[i]):
            return None
        trial = q.copy()
        trial[this.q_index] = joints
        return trial

    def _touching(
        self, q: Array, limb: int, base: pin.SE3, found: Footholds, i: int
    ) -> tuple[Array, Contact] | None:
        """Configuration and contact of a limb that moves on a surface only, beside a foothold.

        No joints put such a limb on a given point: its contact is where it meets the plane.
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
        """True where a contact differs from the one that it replaces."""
        if replaced is None:
            return True
        moved = float(np.linalg.norm(contact.position - replaced.position))
        return moved > self.options.move
