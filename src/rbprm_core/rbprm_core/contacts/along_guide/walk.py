"""One step of a sequence: the next root with one contact change, or a contact moved at rest."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import SequenceOptions
from rbprm_core.guide.root.path import GuidePath

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Obstruction:
    """Why a step failed: the limb's index (-1 where no single limb is to blame) and the reason."""

    limb: int
    reason: str


@dataclass(frozen=True, eq=False)
class _Kept:
    """A configuration at a new root whose kept contacts hold and are clear of everything.

    Attributes:
        q: (nq,) configuration. contacts: those that are kept, oldest first.
        broken: limb whose contact is lost, None where none is.
        loose: limb that has no posture clear of everything yet, None where all have one.
    """

    q: Array
    contacts: list[Contact]
    broken: int | None
    loose: int | None


class Walk:
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
        self._tied = [k for k in range(len(generator.robot.limbs)) if generator.tied(k)]
        self._view: tuple[float, LookAhead] | None = None
        self._tried: set[float] = set()
        self._stood: set[float] = set()

    def advance(self, state: State, mark: float, floor: float | None = None) -> State | Obstruction:
        """A state at the next root with one contact change at most (Algorithm 2).

        Args:
            floor: least b0 that is taken where the threshold is not reached; None for none.
        """
        found = self._advance(state, mark, floor)
        counts = self._generator.counters.counts
        counts["roots"] += mark not in self._tried
        self._tried.add(mark)
        if isinstance(found, State):
            counts["roots_in_equilibrium"] += mark not in self._stood
            self._stood.add(mark)
        return found

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

    def reposition(
        self,
        state: State,
        mark: float,
        moved: set[int],
        obstruction: Obstruction | None,
        floor: float | None = None,
    ) -> State | None:
        """The state with one contact made or moved, the root at rest (Algorithm 3).

        Contacts without which the robot still stands come first; others only where the walk is
        stuck.

        Args:
            moved: limbs that were moved at this root already, and stay.
            obstruction: what the walk is stuck at; its limb's contact is the first to be moved.
            floor: least b0 that is taken where the threshold is not reached; None for none.
        """
        blamed = -1 if obstruction is None else obstruction.limb
        if self._options.prefer_supported:
            found = self._move_one(state, mark, moved, blamed, True, floor)
            if found is not None:
                return found
        if obstruction is None:
            return None
        return self._move_one(state, mark, moved, blamed, False, floor)

    def make(
        self, state: State, mark: float, limb: int, floor: float | None = None
    ) -> State | None:
        """The state with a contact of a free limb made, the root at rest; None where none is.

        Args:
            floor: least b0 that is taken where the threshold is not reached; None for none.
        """
        ahead = self._ahead(mark)
        found = self._generator.generate(state.q, limb, state.contacts, ahead, floor=floor)
        if isinstance(found, str):
            return None
        free = [k for k in state.free if k != limb]
        return self._generator.state(found[0], [*state.contacts, found[1]], free, found[2])

    def _advance(self, state: State, mark: float, floor: float | None) -> State | Obstruction:
        generator = self._generator
        q = state.q.copy()
        q[generator.robot.root_index] = self._guide.at(mark)
        q = self._slacken(state, q)
        if not generator.collision.root_free(q):
            return Obstruction(-1, "the root part collides with the environment")
        kept = self._keep_contacts(state, q)
        if isinstance(kept, Obstruction):
            return kept
        return self._complete(state, kept, mark, floor)

    def _slacken(self, state: State, q: Array) -> Array:
        """q with the root as far off the guide as the oldest contact of a tied limb asks for."""
        if self._options.root_slack > 0:
            for contact in state.contacts:
                if contact.limb in self._tied:
                    moved = self._generator.follow(q, contact, self._options.root_slack)
                    if moved is not None:
                        return moved
        return q

    def _move_one(
        self,
        state: State,
        mark: float,
        moved: set[int],
        blamed: int,
        supported: bool,
        floor: float | None,
    ) -> State | None:
        """Free limbs first, then the blamed one, then the oldest; who is moved is the youngest."""
        generator, ahead = self._generator, self._ahead(mark)
        for limb in state.free:
            made = self.make(state, mark, limb, floor)
            if made is not None:
                return made
        for old in sorted(state.contacts, key=lambda contact: contact.limb != blamed):
            others = [c for c in state.contacts if c is not old]
            if old.limb in moved:
                continue
            if supported and generator.robustness(state.q, others) < 0:
                continue
            found = generator.generate(state.q, old.limb, others, ahead, replaced=old, floor=floor)
            if not isinstance(found, str):
                return generator.state(found[0], [*others, found[1]], state.free, found[2])
        return None

    def _keep_contacts(self, state: State, q: Array) -> _Kept | Obstruction:
        """Project every contact's limb back; at most one contact may break.

        A limb that still has to find its posture is in nobody's way.
        """
        kept: list[Contact] = []
        broken: list[int] = []
        for contact in state.contacts:
            moved = self._generator.maintain(q, contact)
            if moved is not None:
                q = moved
                kept.append(contact)
                continue
            broken.append(contact.limb)
            if len(broken) > 1:
                return Obstruction(contact.limb, "a second contact leaves its limb's reach")
        passing = {*broken, *state.free, *(c.limb for c in kept)}
        for contact in list(kept):
            passing.remove(contact.limb)
            if self._free(q, contact, passing):
                continue
            passing.add(contact.limb)
            broken.append(contact.limb)
            kept.remove(contact)
            if len(broken) > 1:
                return Obstruction(contact.limb, "a second contact is lost to a collision")
        return self._rest_free(state.free, q, kept, broken)

    def _free(self, q: Array, contact: Contact, without: Iterable[int]) -> bool:
        with self._generator.counters.timed("collision"):
            return self._generator.collision.limb_free(q, contact.limb, contact.normal, without)

    def _rest_free(
        self, free: tuple[int, ...], q: Array, kept: list[Contact], broken: list[int]
    ) -> _Kept | Obstruction:
        """Keep limbs that touch nothing clear of everything; one that cannot has to make contact.

        A broken limb needs no posture yet: it mostly makes contact again at once.
        """
        passing = {*broken, *free}
        loose = broken[0] if broken else None
        for limb in free:
            passing.remove(limb)
            rested = self._generator.rest(q, limb, self._rng, passing)
            if rested is not None:
                q = rested
            elif loose is not None:
                return Obstruction(limb, "finds no posture free of collision")
            else:
                loose = limb
                passing.add(limb)
        return _Kept(q, kept, broken[0] if broken else None, loose)

    def _complete(
        self, state: State, kept: _Kept, mark: float, floor: float | None
    ) -> State | Obstruction:
        """Make the one contact that the rule allows, or stand on those that were kept."""
        generator = self._generator
        free = list(state.free) if kept.broken is None else [*state.free, kept.broken]
        # The limb that broke has used the transition's one change: only it may make contact.
        candidates = free if kept.loose is None else [kept.loose]
        reason = "equilibrium"
        weak: list[State] = []  # under the threshold, over the floor
        for limb in candidates:
            found = generator.generate(kept.q, limb, kept.contacts, self._ahead(mark), floor=floor)
            if isinstance(found, str):
                reason = found
                continue
            rest = [k for k in free if k != limb]
            made = generator.state(found[0], [*kept.contacts, found[1]], rest, found[2])
            if made.robustness >= generator.threshold:
                return made
            weak.append(made)
        standing = self._stand(kept, free)
        if standing is not None and standing.robustness >= generator.threshold:
            return standing
        if standing is not None and floor is not None and standing.robustness >= floor:
            weak.append(standing)
        if weak:
            return max(weak, key=lambda found: found.robustness)
        if kept.loose is not None:
            return Obstruction(kept.loose, f"finds no contact ({reason})")
        value = -np.inf if standing is None else standing.robustness
        return Obstruction(-1, f"robustness {value:.3g} N under {generator.threshold:g} N")

    def _stand(self, kept: _Kept, free: list[int]) -> State | None:
        """The state on the kept contacts alone; None where the loose limb finds no posture."""
        generator, q = self._generator, kept.q
        value = generator.robustness(q, kept.contacts)
        if kept.loose is None:
            return generator.state(q, kept.contacts, free, value)
        if value < generator.floor:  # asked first: it is the cheaper test
            return None
        rested = generator.rest(q, kept.loose, self._rng)
        if rested is None:
            return None
        value = generator.robustness(rested, kept.contacts)
        return generator.state(rested, kept.contacts, free, value)

    def _ahead(self, mark: float) -> LookAhead:
        """What lies ahead of a place on the guide; kept, for contacts are moved at rest."""
        if self._view is not None and self._view[0] == mark:
            return self._view[1]
        options = self._options
        ahead = LookAhead.along(self._guide, mark, options.look_ahead, options.step)
        self._view = (mark, ahead)
        return ahead
