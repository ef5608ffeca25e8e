"""From a guide to a sequence of contact states (Tonneau et al. 2018, section 4.2, appendix B)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.options import SequenceOptions
from rbprm_core.contacts.along_guide.walk import Walk
from rbprm_core.contacts.along_guide.walk_state import WalkState
from rbprm_core.errors import Cancelled, NoSequenceFound, TimeLimitReached
from rbprm_core.failures import Failure
from rbprm_core.guide.protocol import Guide
from rbprm_core.stages import Stage


def plan_sequence(
    generator: ContactGenerator,
    guide: Guide,
    start: WalkState,
    budget: Budget,
    rng: np.random.Generator,
    options: SequenceOptions = SequenceOptions(),  # noqa: B008 (frozen)
    goal_limbs: Collection[int] = (),
    on_states: Callable[[Sequence[State]], None] = lambda states: None,
) -> list[WalkState]:
    """States along the guide, from the start state to the guide's end (Algorithm 1).

    Neighbouring states differ by one broken, made or moved contact at most. A step that fails is
    halved before a contact is moved: shorter steps break fewer contacts at once.

    Args:
        generator: the contact generator.
        guide: the guide.
        start: the first state, at the guide's beginning.
        budget: time limit, cancel and progress.
        rng: random generator.
        options: options of the sequence.
        goal_limbs: indices of the limbs to be in contact at the end; the last state may lack those
            that find no contact there.
        on_states: called with the states so far, the start state first, whenever one is added.

    Raises:
        NoSequenceFound: the guide cannot be followed further.
        TimeLimitReached, Cancelled: from the budget.

        The attribute `states` of each has the states so far, `fraction` the share of the guide
        that they cover.
    """
    walk = Walk(generator, guide, rng, options)
    states = _Growing(start, on_states)
    try:
        _follow(walk, generator, guide, states, budget, options)
        _make_goal_contacts(walk, states, guide.length, goal_limbs)
    except (TimeLimitReached, Cancelled) as error:
        error.states, error.fraction = tuple(states.states), states.fraction
        raise
    return states.states


class _Growing:
    """A sequence that reports its states whenever one is added.

    Attributes:
        states: the states so far.
        fraction: share of the guide that they cover, 0 to 1.
    """

    def __init__(self, start: WalkState, on_states: Callable[[Sequence[State]], None]) -> None:
        self.states: list[WalkState] = []
        self.fraction = 0.0
        self._on_states = on_states
        self.add(start)

    @property
    def last(self) -> WalkState:
        """The newest state."""
        return self.states[-1]

    def add(self, state: WalkState) -> None:
        """Add a state."""
        self.states.append(state)
        self._on_states(tuple(self.states))


def _follow(
    walk: Walk,
    generator: ContactGenerator,
    guide: Guide,
    states: _Growing,
    budget: Budget,
    options: SequenceOptions,
) -> None:
    """Add the states along a guide, that at its end included."""
    s, step = 0.0, options.step
    moved: set[int] = set()  # limbs moved at this root; each once is enough
    fallback: float | None = None  # b0 accepted as a last resort, None while there are other ways
    while s < guide.length:
        states.fraction = s / guide.length
        budget.check(Stage.CONTACTS, states.fraction, len(states.states))
        last, target = states.last, min(s + step, guide.length)
        found = walk.advance(last, target, fallback)
        obstruction = found if isinstance(found, Failure) else None
        instead = None
        if isinstance(found, Failure) or not walk.supported(last, found):
            instead = walk.reposition(last, s, moved, obstruction, fallback)
        if instead is not None:
            states.add(instead)
            fallback = None
            moved.add(instead.contacts[-1].limb)
        elif isinstance(found, WalkState):
            states.add(found)
            s, step, fallback = target, min(2 * step, options.step), None
            moved.clear()
        elif step > options.min_step:
            step /= 2
        elif fallback is None and generator.options.accept_below_threshold:
            step, fallback = options.step, generator.fallback_robustness
        else:
            found_states = tuple(states.states)
            raise NoSequenceFound(len(found_states) - 1, found, states.fraction, found_states)
    states.fraction = 1.0


def _make_goal_contacts(
    walk: Walk, states: _Growing, s: float, goal_limbs: Collection[int]
) -> None:
    """Add states at the goal in which free limbs that are to be in contact there make contact."""
    for limb in [limb for limb in states.last.free if limb in goal_limbs]:
        made = walk.make(states.last, s, limb)
        if made is not None:
            states.add(made)
