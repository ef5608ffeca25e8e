"""From a guide path to a sequence of contact states (section 4.2, appendix B)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.options import SequenceOptions
from rbprm_core.contacts.along_guide.walk import Obstruction, Walk
from rbprm_core.errors import Cancelled, NoSequenceFound, TimeLimitReached
from rbprm_core.guide.root.path import GuidePath


def plan_sequence(
    generator: ContactGenerator,
    guide: GuidePath,
    start: State,
    budget: Budget,
    rng: np.random.Generator,
    options: SequenceOptions = SequenceOptions(),  # noqa: B008 (frozen)
    goal_limbs: Collection[int] = (),
    on_states: Callable[[Sequence[State]], None] = lambda states: None,
) -> list[State]:
    """States along the guide, from the start state to the guide's end (Algorithm 1).

    Neighbouring states differ by one broken, made or moved contact at most. A step that fails is
    halved before a contact is moved: shorter steps break fewer contacts at once.

    Args:
        goal_limbs: limbs that are to be in contact at the end; the last state may lack those that
            find none there.
        on_states: told the states so far, the start state first, whenever there are more.

    Raises:
        NoSequenceFound: where the guide cannot be followed further.
        TimeLimitReached, Cancelled: from the budget.

        The attribute `states` of each has the states so far, `fraction` the share of the guide
        that they cover.
    """
    walk = Walk(generator, guide, rng, options)
    states = _Growing(start, on_states)
    try:
        _follow(walk, generator, guide, states, budget, options)
        _settle(walk, states, guide.length, goal_limbs)
    except (TimeLimitReached, Cancelled) as error:
        error.states, error.fraction = tuple(states.states), states.fraction
        raise
    return states.states


class _Growing:
    """A sequence that tells somebody whenever it has grown.

    Attributes:
        fraction: share of the guide that it covers, 0 to 1.
    """

    def __init__(self, start: State, told: Callable[[Sequence[State]], None]) -> None:
        self.states: list[State] = []
        self.fraction = 0.0
        self._told = told
        self.add(start)

    @property
    def last(self) -> State:
        """The newest state."""
        return self.states[-1]

    def add(self, state: State) -> None:
        """Go on to another state."""
        self.states.append(state)
        self._told(tuple(self.states))


def _follow(
    walk: Walk,
    generator: ContactGenerator,
    guide: GuidePath,
    states: _Growing,
    budget: Budget,
    options: SequenceOptions,
) -> None:
    """Add the states along a guide, the goal's included."""
    mark, step = 0.0, options.step
    moved: set[int] = set()  # limbs moved at this root; once each is enough
    floor: float | None = None  # least b0 taken as a last resort, None while there are others
    while mark < guide.length:
        states.fraction = mark / guide.length
        budget.check("sequence", states.fraction, len(states.states))
        last, target = states.last, min(mark + step, guide.length)
        found = walk.advance(last, target, floor)
        stuck = found if isinstance(found, Obstruction) else None
        instead = None
        if isinstance(found, Obstruction) or not walk.supported(last, found):
            instead = walk.reposition(last, mark, moved, stuck, floor)
        if instead is not None:
            states.add(instead)
            floor = None
            moved.add(instead.contacts[-1].limb)
        elif isinstance(found, State):
            states.add(found)
            mark, step, floor = target, min(2 * step, options.step), None
            moved.clear()
        elif step > options.min_step:
            step /= 2
        elif floor is None and generator.options.accept_below_threshold:
            step, floor = options.step, generator.floor
        else:
            raise _stopped(generator, states.states, found, states.fraction)
    states.fraction = 1.0


def _settle(walk: Walk, states: _Growing, mark: float, goal_limbs: Collection[int]) -> None:
    """Add states at the goal that bring the limbs in contact that are wanted there and are free."""
    for limb in [limb for limb in states.last.free if limb in goal_limbs]:
        made = walk.make(states.last, mark, limb)
        if made is not None:
            states.add(made)


def _stopped(
    generator: ContactGenerator, states: list[State], why: Obstruction, fraction: float
) -> NoSequenceFound:
    limb = generator.robot.limbs[why.limb].name if why.limb >= 0 else ""
    return NoSequenceFound(len(states) - 1, limb, why.reason, fraction, tuple(states))
