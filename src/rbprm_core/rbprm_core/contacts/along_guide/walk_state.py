"""A state with the order in which the along-guide planner moves its limbs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rbprm_core.body.state import State
from rbprm_core.body.transition import is_kept


@dataclass(frozen=True, eq=False)
class WalkState(State):
    """A state, its contacts oldest first: the first-in, first-out order of appendix B.

    Tonneau et al. 2018, appendix B.

    Attributes:
        free: indices of the limbs without contact, free for the longest time first.
    """

    free: tuple[int, ...]


def walk_state(history: Sequence[State], limbs: int) -> WalkState:
    """The last state of a sequence, with the order that follows from the states before it.

    In the first state the order of its contacts counts, and free limbs are in the robot's order.

    Args:
        history: the states so far, one at least.
        limbs: number of limbs of the robot.
    """
    ordered: WalkState | None = None
    for state in history:
        ordered = _ordered(ordered, state, limbs)
    assert ordered is not None
    return ordered


def _ordered(before: WalkState | None, state: State, limbs: int) -> WalkState:
    """A state ordered after the one before it."""
    held = {contact.limb for contact in state.contacts}
    free = [limb for limb in range(limbs) if limb not in held]
    contacts = list(state.contacts)
    if before is not None:
        kept = [old.limb for old in before.contacts if is_kept(old, state.contact_of(old.limb))]
        contacts.sort(key=lambda c: kept.index(c.limb) if c.limb in kept else len(kept))
        longest = [limb for limb in before.free if limb in free]
        free = [*longest, *(limb for limb in free if limb not in longest)]
    return WalkState(state.q, tuple(contacts), state.com, state.robustness, tuple(free))
