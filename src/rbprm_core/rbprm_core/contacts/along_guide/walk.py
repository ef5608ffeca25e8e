"""One step of a sequence: the next root with one contact change, or a contact moved at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.state_failures import low_robustness
from rbprm_core.body.transition import Transition
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import SequenceOptions
from rbprm_core.contacts.along_guide.walk_state import WalkState
from rbprm_core.counters import ROOTS, ROOTS_IN_EQUILIBRIUM
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.protocol import Guide


@dataclass(frozen=True, eq=False)
class _Kept:
    """A configuration at a new root whose kept contacts hold and are free of collision.

    Attributes:
        q: (nq,) configuration.
        contacts: the kept contacts, oldest first.
        broken: index of the limb that lost its contact, None where none did.
        loose: index of the limb without a collision-free posture so far, None where all have one.
    """

    q: Array
    contacts: list[Contact]
    broken: int | None
    loose: int | None


class Walk:
    """The steps along one guide (Tonneau et al. 2018, appendix B).

    Args:
        generator: the contact generator.
        guide: the guide.
        rng: random generator.
        options: options of the sequence.
    """

    def __init__(
        self,
        generator: ContactGenerator,
        guide: Guide,
        rng: np.random.Generator,
        options: SequenceOptions,
    ) -> None:
        self._generator, self._guide, self._rng = generator, guide, rng
        self._body, self._options = generator.body, options
        limbs = range(len(generator.robot.limbs))
        self._on_surface = [k for k in limbs if self._body.moves_on_surface_only(k)]
        self._names = [limb.name for limb in generator.robot.limbs]
        self._view: tuple[float, LookAhead] | None = None
        self._tried: set[float] = set()
        self._reached: set[float] = set()

    def advance(
        self, state: WalkState, s: float, fallback: float | None = None
    ) -> WalkState | Failure:
        """A state at the next root with one contact change at most (Algorithm 2).

        Args:
            state: the last state.
            s: arc length of the next root along the guide, metres.
            fallback: b0 that is accepted where the request's is not reached, newtons; None for
                none.

        Returns:
            The state, or why there is none.
        """
        found = self._advance(state, s, fallback)
        counts = self._generator.counters.counts
        counts[ROOTS] += s not in self._tried
        self._tried.add(s)
        if isinstance(found, WalkState):
            counts[ROOTS_IN_EQUILIBRIUM] += s not in self._reached
            self._reached.add(s)
        return found

    def supported(self, before: WalkState, after: WalkState) -> bool:
        """True where the contacts shared by two states hold the robot in one of the two at least.

        Not in Tonneau et al. 2018. The moving limb carries nothing in between, so that the other
        contacts have to hold the robot somewhere on the way. Always true without the option
        `prefer_supported`.

        Args:
            before: the first state.
            after: the second state.
        """
        if not self._options.prefer_supported:
            return True
        transition = Transition.between(before, after)
        if not transition.changes:
            return True
        shared = transition.shared_contacts
        return any(self._body.robustness(state.q, shared) >= 0 for state in (after, before))

    def reposition(
        self,
        state: WalkState,
        s: float,
        moved: set[int],
        obstruction: Failure | None,
        fallback: float | None = None,
    ) -> WalkState | None:
        """The state with one contact made or moved, the root at rest (Algorithm 3).

        Contacts without which the robot stays in equilibrium come first; the others are moved only
        where the step ahead failed.

        Args:
            state: the last state.
            s: arc length of its root along the guide, metres.
            moved: indices of the limbs that were moved at this root already, and stay.
            obstruction: why the step ahead failed, None where it did not; the contact of its limb
                is moved first.
            fallback: b0 that is accepted where the request's is not reached, newtons; None for
                none.

        Returns:
            The state, None where no contact can be made or moved.
        """
        first = -1
        if obstruction is not None and obstruction.limb:
            first = self._names.index(obstruction.limb)
        if self._options.prefer_supported:
            found = self._move_one(state, s, moved, first, True, fallback)
            if found is not None:
                return found
        if obstruction is None:
            return None
        return self._move_one(state, s, moved, first, False, fallback)

    def make(
        self, state: WalkState, s: float, limb: int, fallback: float | None = None
    ) -> WalkState | None:
        """The state with a contact of a free limb made, the root at rest; None where none is found.

        Args:
            state: the last state.
            s: arc length of its root along the guide, metres.
            limb: index of the free limb.
            fallback: b0 that is accepted where the request's is not reached, newtons; None for
                none.
        """
        ahead = self._ahead(s)
        found = self._generator.generate(state.q, limb, state.contacts, ahead, fallback=fallback)
        if isinstance(found, Cause):
            return None
        free = [k for k in state.free if k != limb]
        contacts = [*state.contacts, found.contact]
        return self._generator.state(found.q, contacts, free, found.robustness)

    def _advance(self, state: WalkState, s: float, fallback: float | None) -> WalkState | Failure:
        q = state.q.copy()
        q[self._generator.robot.root_index] = self._guide.root(s)
        q = self._shift_root(state, q)
        if not self._body.collision.root_free(q):
            return Failure.of(Cause.ROOT_COLLISION)
        kept = self._keep_contacts(state, q)
        if isinstance(kept, Failure):
            return kept
        return self._complete(state, kept, s, fallback)

    def _shift_root(self, state: WalkState, q: Array) -> Array:
        """q with the root off the guide as the oldest contact that moves on a surface needs it."""
        if self._options.root_slack > 0:
            for contact in state.contacts:
                if contact.limb in self._on_surface:
                    moved = self._body.project_with_root(q, contact, self._options.root_slack)
                    if moved is not None:
                        return moved
        return q

    def _move_one(
        self,
        state: WalkState,
        s: float,
        moved: set[int],
        first: int,
        supported: bool,
        fallback: float | None,
    ) -> WalkState | None:
        """Free limbs, then the limb `first`, then the oldest contact; what is moved is youngest."""
        generator, ahead = self._generator, self._ahead(s)
        for limb in state.free:
            made = self.make(state, s, limb, fallback)
            if made is not None:
                return made
        for old in sorted(state.contacts, key=lambda contact: contact.limb != first):
            others = [c for c in state.contacts if c is not old]
            if old.limb in moved:
                continue
            if supported and self._body.robustness(state.q, others) < 0:
                continue
            found = generator.generate(
                state.q, old.limb, others, ahead, replaced=old, fallback=fallback
            )
            if not isinstance(found, Cause):
                contacts = [*others, found.contact]
                return generator.state(found.q, contacts, state.free, found.robustness)
        return None

    def _keep_contacts(self, state: WalkState, q: Array) -> _Kept | Failure:
        """Project every contact's limb back; at most one contact may break.

        A limb whose posture is not known yet is not tested against.
        """
        kept: list[Contact] = []
        broken: list[int] = []
        for contact in state.contacts:
            moved = self._body.project(q, contact)
            if moved is not None:
                q = moved
                kept.append(contact)
                continue
            broken.append(contact.limb)
            if len(broken) > 1:
                return self._failure(Cause.SECOND_CONTACT_OUT_OF_REACH, contact.limb)
        unplaced = {*broken, *state.free, *(c.limb for c in kept)}
        for contact in list(kept):
            unplaced.remove(contact.limb)
            if self._body.limb_is_free(q, contact.limb, contact.normal, unplaced):
                continue
            unplaced.add(contact.limb)
            broken.append(contact.limb)
            kept.remove(contact)
            if len(broken) > 1:
                return self._failure(Cause.SECOND_CONTACT_COLLISION, contact.limb)
        return self._place_free_limbs(state.free, q, kept, broken)

    def _place_free_limbs(
        self, free: tuple[int, ...], q: Array, kept: list[Contact], broken: list[int]
    ) -> _Kept | Failure:
        """Collision-free postures of the limbs without contact; one without must make contact.

        A limb that lost its contact needs no posture yet: it mostly makes contact again at once.
        """
        unplaced = {*broken, *free}
        loose = broken[0] if broken else None
        for limb in free:
            unplaced.remove(limb)
            rested = self._generator.rest(q, limb, self._rng, unplaced)
            if rested is not None:
                q = rested
            elif loose is not None:
                return self._failure(Cause.NO_FREE_POSTURE, limb)
            else:
                loose = limb
                unplaced.add(limb)
        return _Kept(q, kept, broken[0] if broken else None, loose)

    def _complete(
        self, state: WalkState, kept: _Kept, s: float, fallback: float | None
    ) -> WalkState | Failure:
        """Make the one contact that the rule allows, or stand on those that were kept."""
        generator, minimum = self._generator, self._generator.min_robustness
        free = list(state.free) if kept.broken is None else [*state.free, kept.broken]
        # The limb that broke has used the transition's one change: only it may make contact.
        candidates = free if kept.loose is None else [kept.loose]
        cause = Cause.NO_EQUILIBRIUM
        weak: list[WalkState] = []  # accepted as a last resort only
        for limb in candidates:
            found = generator.generate(
                kept.q, limb, kept.contacts, self._ahead(s), fallback=fallback
            )
            if isinstance(found, Cause):
                cause = found
                continue
            rest = [k for k in free if k != limb]
            contacts = [*kept.contacts, found.contact]
            made = generator.state(found.q, contacts, rest, found.robustness)
            if made.robustness >= minimum:
                return made
            weak.append(made)
        on_kept = self._on_kept_contacts(kept, free)
        if on_kept is not None and on_kept.robustness >= minimum:
            return on_kept
        if on_kept is not None and fallback is not None and on_kept.robustness >= fallback:
            weak.append(on_kept)
        if weak:
            return max(weak, key=lambda found: found.robustness)
        if kept.loose is not None:
            return self._failure(cause, kept.loose)
        value = -np.inf if on_kept is None else on_kept.robustness
        return low_robustness(value, minimum, len(kept.contacts))

    def _on_kept_contacts(self, kept: _Kept, free: list[int]) -> WalkState | None:
        """The state on the kept contacts alone; None where the loose limb finds no posture."""
        generator, q = self._generator, kept.q
        value = self._body.robustness(q, kept.contacts)
        if kept.loose is None:
            return generator.state(q, kept.contacts, free, value)
        if value < generator.fallback_robustness:  # before the posture: it is the cheaper test
            return None
        rested = generator.rest(q, kept.loose, self._rng)
        if rested is None:
            return None
        value = self._body.robustness(rested, kept.contacts)
        return generator.state(rested, kept.contacts, free, value)

    def _failure(self, cause: Cause, limb: int) -> Failure:
        return Failure.of(cause, self._names[limb])

    def _ahead(self, s: float) -> LookAhead:
        """What lies ahead of an arc length on the guide; kept, since contacts are moved at rest."""
        if self._view is not None and self._view[0] == s:
            return self._view[1]
        options = self._options
        ahead = LookAhead.along(self._guide, s, options.look_ahead, options.step)
        self._view = (s, ahead)
        return ahead
