"""From a guide path to a sequence of contact states (section 4.2, appendix B)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rbprm_core.budget import Budget
from rbprm_core.contacts.generator import ContactGenerator
from rbprm_core.contacts.look_ahead import LookAhead
from rbprm_core.contacts.state import Contact, State
from rbprm_core.errors import NoSequenceFound
from rbprm_core.guide.path import GuidePath

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SequenceOptions:
    """Options of the sequence.

    Attributes:
        step: distance of root configurations along the guide, metres (section 6.2.4).
        least_step: a step that fails is halved down to this, metres.
        look_ahead: metres of guide ahead by which contacts are ranked.
        prefer_supported: rather move a contact without which the robot still stands; false keeps to
            the paper's order, with fewer transitions and less time.
    """

    step: Annotated[float, Field(gt=0)] = 0.1
    least_step: Annotated[float, Field(gt=0)] = 0.0125
    look_ahead: Annotated[float, Field(ge=0)] = 0.4
    prefer_supported: bool = True


@dataclass(frozen=True)
class Obstruction:
    """Why a step failed: the limb's index (-1 where no single limb is to blame) and the reason."""

    limb: int
    reason: str


def plan_sequence(
    generator: ContactGenerator,
    guide: GuidePath,
    start: State,
    budget: Budget,
    rng: np.random.Generator,
    options: SequenceOptions = SequenceOptions(),
) -> list[State]:
    """States along the guide, from the start state to the guide's end (Algorithm 1).

    Neighbouring states differ by one broken, made or moved contact at most. A step that fails is
    halved before a contact is moved: shorter steps break fewer contacts at once.

    Raises:
        NoSequenceFound: where the guide cannot be followed further; the states so far are in its
            attribute `states`.
        TimeLimitReached, Cancelled: from the budget.
    """
    walk = _Walk(generator, guide, rng, options)
    states = [start]
    mark, step = 0.0, options.step
    moved: set[int] = set()  # limbs moved at this root; once each is enough
    while mark < guide.length:
        budget.check("sequence", mark / guide.length, len(states))
        last, target = states[-1], min(mark + step, guide.length)
        found = walk.advance(last, target)
        stuck = isinstance(found, Obstruction)
        instead = None
        if isinstance(found, Obstruction) or not walk.supported(last, found):
            instead = walk.reposition(last, mark, moved, stuck)
        if instead is not None:
            states.append(instead)
            moved.add(instead.contacts[-1].limb)
        elif isinstance(found, State):
            states.append(found)
            mark, step = target, min(2 * step, options.step)
            moved.clear()
        elif step > options.least_step:
            step /= 2
        else:
            raise _stopped(generator, states, found, mark / guide.length)
    return states


def _stopped(
    generator: ContactGenerator, states: list[State], why: Obstruction, fraction: float
) -> NoSequenceFound:
    limb = generator.robot.limbs[why.limb].name if why.limb >= 0 else ""
    return NoSequenceFound(len(states) - 1, limb, why.reason, fraction, tuple(states))


class _Walk:
    """The steps along one guide."""

    def __init__(
        self,
        generator: ContactGenerator,
        guide: GuidePath,
        rng: np.random.Generator,
        options: SequenceOptions,
    ) -> None:
        self._generator, self._guide, self._rng = generator, guide, rng
        self._options = options

    def advance(self, state: State, mark: float) -> State | Obstruction:
        """A state at the next root with one contact change at most (Algorithm 2)."""
        generator = self._generator
        q = state.q.copy()
        q[generator.robot.root_index] = self._guide.at(mark)
        if not generator.collision.root_free(q):
            return Obstruction(-1, "the root part collides with the environment")
        kept = self._keep_contacts(state, q)
        if isinstance(kept, Obstruction):
            return kept
        q, contacts, broken = kept
        free = self._free_limbs(state.free, q)
        if isinstance(free, Obstruction):
            return free
        q = free
        return self._complete(q, state, contacts, broken, mark)

    def supported(self, before: State, after: State) -> bool:
        """True where the contacts common to two states hold the robot at one of the two at least.

        Not in the paper. The moving limb bears nothing in between, so the robot has to stand on the
        others somewhere on the way.
        """
        if not self._options.prefer_supported:
            return True
        changed = {c.limb for c in before.contacts} ^ {c.limb for c in after.contacts}
        changed |= {c.limb for c in after.contacts if before.contact_of(c.limb) not in (None, c)}
        if not changed:
            return True
        common = [c for c in before.contacts if c.limb not in changed]
        return any(self._generator.robustness(s.q, common) >= 0 for s in (after, before))

    def reposition(self, state: State, mark: float, moved: set[int], stuck: bool) -> State | None:
        """The state with one contact made or moved, the root at rest (Algorithm 3).

        Contacts without which the robot still stands come first; others only where the walk is
        stuck.

        Args:
            moved: limbs that were moved at this root already, and stay.
        """
        if self._options.prefer_supported:
            found = self._move_one(state, mark, moved, supported=True)
            if found is not None:
                return found
        return self._move_one(state, mark, moved, supported=False) if stuck else None

    def _move_one(
        self, state: State, mark: float, moved: set[int], supported: bool
    ) -> State | None:
        """Free limbs first, then the oldest contacts; a limb that is moved becomes the youngest."""
        generator, ahead = self._generator, self._ahead(mark)
        for limb in state.free:
            found = generator.generate(state.q, limb, state.contacts, ahead)
            if not isinstance(found, str):
                rest = [k for k in state.free if k != limb]
                return generator.state(found[0], [*state.contacts, found[1]], rest, found[2])
        for old in state.contacts:
            others = [c for c in state.contacts if c is not old]
            if old.limb in moved:
                continue
            if supported and generator.robustness(state.q, others) < 0:
                continue
            found = generator.generate(state.q, old.limb, others, ahead, replaced=old)
            if not isinstance(found, str):
                return generator.state(found[0], [*others, found[1]], state.free, found[2])
        return None

    def _keep_contacts(
        self, state: State, q: Array
    ) -> tuple[Array, list[Contact], Contact | None] | Obstruction:
        """Project every contact's limb back; at most one contact may break."""
        generator = self._generator
        kept, broken = [], []
        for contact in state.contacts:
            moved = generator.maintain(q, contact)
            if moved is None:
                broken.append(contact)
                if len(broken) > 1:
                    return Obstruction(contact.limb, "a second contact leaves its limb's reach")
            else:
                q = moved
                kept.append(contact)
        rested = self._rest_broken(q, broken)
        if rested is None:
            return Obstruction(broken[0].limb, "finds no posture free of collision")
        q = rested
        for contact in list(kept):
            with generator.tally.timed("collision"):
                free = generator.collision.limb_free(q, contact.limb, contact.normal)
            if free:
                continue
            if broken:
                return Obstruction(contact.limb, "a second contact is lost to a collision")
            kept.remove(contact)
            broken.append(contact)
            rested = self._rest_broken(q, broken)
            if rested is None:
                return Obstruction(contact.limb, "finds no posture free of collision")
            q = rested
        return q, kept, broken[0] if broken else None

    def _rest_broken(self, q: Array, broken: list[Contact]) -> Array | None:
        return self._generator.rest(q, broken[0].limb, self._rng) if broken else q

    def _free_limbs(self, limbs: tuple[int, ...], q: Array) -> Array | Obstruction:
        """Keep limbs that touch nothing clear of everything at the new root."""
        for limb in limbs:
            rested = self._generator.rest(q, limb, self._rng)
            if rested is None:
                return Obstruction(limb, "finds no posture free of collision")
            q = rested
        return q

    def _complete(
        self, q: Array, state: State, contacts: list[Contact], broken: Contact | None, mark: float
    ) -> State | Obstruction:
        """Make the one contact that the rule allows, or stand on those that were kept."""
        generator, ahead = self._generator, self._ahead(mark)
        # The limb that broke has used the transition's one change: only it may make contact.
        candidates = [broken.limb] if broken is not None else list(state.free)
        free = [*state.free, broken.limb] if broken is not None else list(state.free)
        reason = "equilibrium"
        for limb in candidates:
            found = generator.generate(q, limb, contacts, ahead)
            if not isinstance(found, str):
                rest = [k for k in free if k != limb]
                return generator.state(found[0], [*contacts, found[1]], rest, found[2])
            reason = found
        value = generator.robustness(q, contacts)
        if value >= generator.threshold:
            return generator.state(q, contacts, free, value)
        if broken is None:
            return Obstruction(-1, f"robustness {value:.3g} N under {generator.threshold:g} N")
        return Obstruction(broken.limb, f"finds no contact ({reason})")

    def _ahead(self, mark: float) -> LookAhead:
        """What lies ahead of a place on the guide."""
        count = 8
        marks = mark + self._options.look_ahead * np.arange(1, count + 1) / count
        roots = np.array([self._guide.at(min(m, self._guide.length)) for m in marks])
        now = self._guide.at(mark)
        motion = roots[-1, :3] - now[:3]
        length = float(np.linalg.norm(motion))
        return LookAhead(now, roots, motion / length if length > 0 else np.zeros(3))
