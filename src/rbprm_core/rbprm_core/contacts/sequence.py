"""From a guide path to a sequence of contact states (section 4.2, appendix B)."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from rbprm_core.budget import Budget
from rbprm_core.contacts.generator import ContactGenerator
from rbprm_core.contacts.options import SequenceOptions
from rbprm_core.contacts.state import State
from rbprm_core.contacts.walk import Obstruction, Walk
from rbprm_core.errors import NoSequenceFound
from rbprm_core.guide.path import GuidePath


def plan_sequence(
    generator: ContactGenerator,
    guide: GuidePath,
    start: State,
    budget: Budget,
    rng: np.random.Generator,
    options: SequenceOptions = SequenceOptions(),  # noqa: B008 (frozen)
    goal_limbs: Collection[int] = (),
) -> list[State]:
    """States along the guide, from the start state to the guide's end (Algorithm 1).

    Neighbouring states differ by one broken, made or moved contact at most. A step that fails is
    halved before a contact is moved: shorter steps break fewer contacts at once.

    Args:
        goal_limbs: limbs that are to be in contact at the end; the last state may lack those that
            find none there.

    Raises:
        NoSequenceFound: where the guide cannot be followed further; the states so far are in its
            attribute `states`.
        TimeLimitReached, Cancelled: from the budget.
    """
    walk = Walk(generator, guide, rng, options)
    states = [start]
    mark, step = 0.0, options.step
    moved: set[int] = set()  # limbs moved at this root; once each is enough
    floor: float | None = None  # least b0 taken as a last resort, None while there are others
    while mark < guide.length:
        budget.check("sequence", mark / guide.length, len(states))
        last, target = states[-1], min(mark + step, guide.length)
        found = walk.advance(last, target, floor)
        stuck = found if isinstance(found, Obstruction) else None
        instead = None
        if isinstance(found, Obstruction) or not walk.supported(last, found):
            instead = walk.reposition(last, mark, moved, stuck, floor)
        if instead is not None:
            states.append(instead)
            floor = None
            moved.add(instead.contacts[-1].limb)
        elif isinstance(found, State):
            states.append(found)
            mark, step, floor = target, min(2 * step, options.step), None
            moved.clear()
        elif step > options.least_step:
            step /= 2
        elif floor is None and generator.options.most_robust:
            step, floor = options.step, generator.floor
        else:
            raise _stopped(generator, states, found, mark / guide.length)
    return [*states, *_settled(walk, states[-1], guide.length, goal_limbs)]


def _settled(walk: Walk, last: State, mark: float, goal_limbs: Collection[int]) -> list[State]:
    """States at the goal that bring the limbs in contact that are wanted there and are free."""
    states = []
    for limb in [limb for limb in last.free if limb in goal_limbs]:
        made = walk.make(last, mark, limb)
        if made is not None:
            last = made
            states.append(made)
    return states


def _stopped(
    generator: ContactGenerator, states: list[State], why: Obstruction, fraction: float
) -> NoSequenceFound:
    limb = generator.robot.limbs[why.limb].name if why.limb >= 0 else ""
    return NoSequenceFound(len(states) - 1, limb, why.reason, fraction, tuple(states))
