"""The contact state at a given root: the first of the sequence, or a test of the goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.state_failures import low_robustness
from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.walk_state import WalkState
from rbprm_core.errors import GoalUnreachable, RootUnreachable, StartUnreachable
from rbprm_core.failures import Cause, Failure
from rbprm_core.stages import Stage


def start_state(
    generator: ContactGenerator,
    root: Array,
    limbs: Sequence[int],
    which: str = "start",
    budget: Budget | None = None,
) -> WalkState:
    """A state in static equilibrium with given limbs in contact, from the reference posture.

    Limbs make contact in the order given. Where that fails, the rotations of the order are tried:
    a limb may obstruct another, and the last one has to complete the equilibrium. Only where no
    order reaches the threshold are they tried again for less, with `accept_below_threshold`.

    Args:
        generator: the contact generator.
        root: (7 + j,) root configuration.
        limbs: indices of the limbs that must be in contact.
        which: "start" or "goal", for the error.
        budget: time limit, cancel and progress; None for no limit.

    Raises:
        StartUnreachable, GoalUnreachable: for the order given; with `accept_below_threshold`, why
            not even for less.
        TimeLimitReached, Cancelled: from the budget.
    """
    kind = StartUnreachable if which == "start" else GoalUnreachable
    q = generator.robot.reference.copy()
    q[generator.robot.root_index] = root
    if not generator.body.collision.root_free(q):
        raise kind(Failure.of(Cause.ROOT_COLLISION))
    if not limbs:
        raise kind(Failure.of(Cause.NO_START_LIMBS))
    orders = [(*limbs[turn:], *limbs[:turn]) for turn in range(len(limbs))]
    tries = [(minimum, order) for minimum in _minima(generator) for order in orders]
    failures: list[RootUnreachable] = []
    for minimum, order in tries:
        if budget is not None:
            budget.check(Stage.START, len(failures) / len(tries))
        try:
            found = _in_order(generator, q, order, minimum, kind)
        except RootUnreachable as error:
            failures.append(error)
            continue
        contacts = sorted(found.contacts, key=lambda contact: limbs.index(contact.limb))
        return replace(found, contacts=tuple(contacts))
    raise failures[-len(orders)]


def _minima(generator: ContactGenerator) -> tuple[float, ...]:
    """b0 of a start to be tried for, newtons: the request's, then that of the last resort."""
    if generator.fallback_robustness < generator.min_robustness:
        return generator.min_robustness, generator.fallback_robustness
    return (generator.min_robustness,)


def _in_order(
    generator: ContactGenerator,
    q: Array,
    limbs: Sequence[int],
    minimum: float,
    kind: type[StartUnreachable | GoalUnreachable],
) -> WalkState:
    """The state that limbs lead to from a configuration (nq,), one after the other.

    Args:
        minimum: b0 that the whole set has to reach, newtons.

    Raises:
        StartUnreachable, GoalUnreachable: the one that `kind` names.
    """
    robot, body = generator.robot, generator.body
    contacts: list[Contact] = []
    fallback = minimum if generator.options.accept_below_threshold else None
    still = LookAhead.still(q[robot.root_index])
    for count, limb in enumerate(limbs, start=1):
        # Equilibrium is required of the whole set only: two feet alone hold no quadruped.
        wanted = generator.min_robustness if count == len(limbs) else -np.inf
        found = generator.generate(
            q, limb, contacts, still, min_robustness=wanted, fallback=fallback
        )
        if isinstance(found, Cause):
            raise kind(Failure.of(found, robot.limbs[limb].name))
        q = found.q
        contacts.append(found.contact)
    free = [k for k in range(len(robot.limbs)) if k not in limbs]
    for limb in free:
        if not body.collision.limb_free(q, limb, None):
            raise kind(Failure.of(Cause.REFERENCE_POSTURE_COLLISION, robot.limbs[limb].name))
    value = body.robustness(q, contacts)
    if value < minimum:
        raise kind(low_robustness(value, minimum, len(contacts)))
    return generator.state(q, contacts, free, value)
