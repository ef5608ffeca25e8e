"""Contacts of neighbouring states: broken, made, moved or kept."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from rbprm_core.check.poses import angle_between
from rbprm_core.check.violation import Kind, Violation
from rbprm_core.plan_record import ContactEntry, ContactPlan, StateEntry

DRIFT_BOUND = 1.5e-3  # metres that a kept contact may move
TURN_BOUND = np.deg2rad(3.0)  # radians; the same as the bound between contact and facet normals
SLACK = 1e-9  # rounding of numbers that the planner compared with the same bound


def repeated_limb_violations(state: StateEntry, index: int) -> Iterator[Violation]:
    """Yield the limbs that have more than one contact in a state.

    Args:
        state: state of the plan.
        index: its index.
    """
    limbs = [contact.limb for contact in state.contacts]
    for limb in sorted({name for name in limbs if limbs.count(name) > 1}):
        text = f"has {limbs.count(limb)} contacts (at most 1)"
        yield Violation(index, limb, Kind.LIMB_TWICE, text)


@dataclass
class ContactTracker:
    """Compares the contacts of each state with the state before and with their first state.

    A contact is kept between neighbouring states if its limb, frame, type and surface stay the same
    and neither a point nor the normal moves by more than its bound; otherwise it has moved. A kept
    contact is also compared with the state in which it was made, so that many small moves are
    noticed. If a limb has more than one contact, the first counts.

    Attributes:
        made: contact of every limb as it was when it was made.
        before: contacts of the last state by limb; None before the first state.
        changed: names of the limbs that changed their contact in the last step.
        transitions: number of steps in which a limb changed its contact.
    """

    made: dict[str, ContactEntry] = field(default_factory=dict)
    before: dict[str, ContactEntry] | None = None
    changed: list[str] = field(default_factory=list)
    transitions: int = 0

    def step(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Yield the violations between the last state and the next one, which becomes the last.

        Args:
            state: next state of the plan.
            index: its index.
        """
        after = _by_limb(state)
        before = after if self.before is None else self.before
        changed = _changed_limbs(before, after)
        self.changed = changed
        self.transitions += bool(changed)
        if len(changed) > 1:
            text = f"{len(changed)} limbs change their contact: {', '.join(changed)} (at most 1)"
            yield Violation(index, "", Kind.CHANGES, text)
        self.made = {
            limb: contact if limb in changed else self.made.get(limb, contact)
            for limb, contact in after.items()
        }
        for limb in sorted(after.keys() - set(changed)):
            yield from self._kept_violations(limb, before[limb], after[limb], index)
        self.before = after

    def _kept_violations(
        self, limb: str, before: ContactEntry, after: ContactEntry, index: int
    ) -> Iterator[Violation]:
        """Yield the changes of friction and the drift of a kept contact."""
        if before.friction != after.friction:
            text = f"friction of a kept contact changes from {before.friction:g}"
            text += f" to {after.friction:g}"
            yield Violation(index, limb, Kind.KEPT_FRICTION, text)
        drift = displacement(self.made[limb], after)
        turn = angle_between(self.made[limb].normal, after.normal)
        if drift > DRIFT_BOUND + SLACK or turn > TURN_BOUND + SLACK:
            text = f"kept contact has drifted by {1e3 * drift:.1f} mm, {np.rad2deg(turn):.2f} deg"
            text += f" (at most {1e3 * DRIFT_BOUND:.1f} mm, {np.rad2deg(TURN_BOUND):.2f} deg)"
            yield Violation(index, limb, Kind.DRIFT, text)
            self.made[limb] = after  # so that the drift is not reported again for later states


def displacement(before: ContactEntry, after: ContactEntry) -> float:
    """Return how far the position or a point of a contact moved at most, metres.

    Args:
        before: contact in the earlier state.
        after: contact in the later state.

    Returns:
        Greatest distance; infinity if the number of points differs.
    """
    if len(before.points) != len(after.points):
        return np.inf
    old = np.array([before.position, *before.points])
    new = np.array([after.position, *after.points])
    return float(np.linalg.norm(new - old, axis=1).max())


def count_transitions(plan: ContactPlan) -> int:
    """Return the number of pairs of neighbouring states between which a contact changes.

    Args:
        plan: plan whose states are compared.
    """
    states = [_by_limb(state) for state in plan.states]
    return sum(bool(_changed_limbs(before, after)) for before, after in pairwise(states))


def _by_limb(state: StateEntry) -> dict[str, ContactEntry]:
    """Return the contacts of a state by limb, the first one if a limb has several."""
    return {contact.limb: contact for contact in reversed(state.contacts)}


def _changed_limbs(before: dict[str, ContactEntry], after: dict[str, ContactEntry]) -> list[str]:
    """Return the names of the limbs that break, make or move their contact."""
    return sorted(limb for limb in before.keys() | after if _is_changed(limb, before, after))


def _is_changed(limb: str, before: dict[str, ContactEntry], after: dict[str, ContactEntry]) -> bool:
    """Return whether a limb breaks, makes or moves its contact."""
    old, new = before.get(limb), after.get(limb)
    if old is None or new is None:
        return True
    if (old.frame, old.type, old.surface) != (new.frame, new.type, new.surface):
        return True
    turn = angle_between(old.normal, new.normal)
    return displacement(old, new) > DRIFT_BOUND + SLACK or turn > TURN_BOUND + SLACK
