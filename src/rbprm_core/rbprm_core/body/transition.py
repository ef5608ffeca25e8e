"""The change of contacts between two neighbouring states."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State

SAME_CONTACT = 1e-3
"""Metres; a limb's contact that moved less from one state to the next was kept."""


class Action(StrEnum):
    """What a transition does to the contacts; the values stand in plan files."""

    NONE = "none"
    MAKE = "make"
    BREAK = "break"
    MOVE = "move"


@dataclass(frozen=True, eq=False)
class ContactChange:
    """The change of one limb's contact from one state to the next.

    Attributes:
        limb: index of the limb.
        before: contact in the first state, None where the limb is free.
        after: contact in the second state, None where the limb is free.
    """

    limb: int
    before: Contact | None
    after: Contact | None

    @property
    def action(self) -> Action:
        """What happens to the limb's contact."""
        if self.before is None:
            return Action.MAKE
        return Action.BREAK if self.after is None else Action.MOVE


@dataclass(frozen=True, eq=False)
class Transition:
    """The step from one state to the next.

    Attributes:
        before: the first state.
        after: the second state.
        changes: contacts that differ, by index of limb; one at most in a valid sequence.
    """

    before: State
    after: State
    changes: tuple[ContactChange, ...]

    @staticmethod
    def between(before: State, after: State) -> Transition:
        """The transition between two neighbouring states.

        Args:
            before: the first state.
            after: the second state.
        """
        changes = []
        for limb in sorted({c.limb for c in (*before.contacts, *after.contacts)}):
            old, new = before.contact_of(limb), after.contact_of(limb)
            if not is_kept(old, new):
                changes.append(ContactChange(limb, old, new))
        return Transition(before, after, tuple(changes))

    @property
    def action(self) -> Action:
        """What the transition does; of several changes, the first counts."""
        return self.changes[0].action if self.changes else Action.NONE

    @property
    def moving_limb(self) -> int | None:
        """Index of the limb whose contact changes, None where none does."""
        return self.changes[0].limb if self.changes else None

    @property
    def shared_contacts(self) -> tuple[Contact, ...]:
        """The first state's contacts that both states have: the stance during the transition."""
        changed = {change.limb for change in self.changes}
        return tuple(c for c in self.before.contacts if c.limb not in changed)


def is_kept(old: Contact | None, new: Contact | None) -> bool:
    """True where a limb keeps its contact: the same object, or one less than 1 mm away.

    Args:
        old: contact in the first state, None where the limb is free.
        new: contact in the second state, None where the limb is free.
    """
    if old is None or new is None:
        return False
    return old is new or float(np.linalg.norm(new.position - old.position)) < SAME_CONTACT


def contact_action(old: Sequence[float] | None, new: Sequence[float] | None) -> Action:
    """What happens to a limb's contact from one state to the next, from its positions alone.

    Args:
        old: (3,) position of the contact in the first state, None where the limb is free, metres.
        new: (3,) position of the contact in the second state, None where the limb is free, metres.
    """
    if old is None:
        return Action.NONE if new is None else Action.MAKE
    if new is None:
        return Action.BREAK
    return Action.NONE if math.dist(old, new) < SAME_CONTACT else Action.MOVE
