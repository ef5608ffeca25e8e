"""The contact state at a given root: the first of the sequence, or a test of the goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.errors import GoalUnreachable, RootUnreachable, StartUnreachable

Array = NDArray[np.float64]


def start_state(
    generator: ContactGenerator,
    root: Array,
    limbs: Sequence[int],
    which: str = "start",
    budget: Budget | None = None,
) -> State:
    """A state in static equilibrium with given limbs in contact, from the reference posture.

    Limbs make contact in the order given. Where that leads nowhere its rotations are tried: a limb
    may be in another's way, and the last one has to complete the equilibrium. Only where no order
    reaches the threshold does `accept_below_threshold` let them be tried again for less.

    Args:
        root: (7 + j,) root configuration. limbs: indices of the limbs that must be in contact.
        which: "start" or "goal", for the error.

    Raises:
        StartUnreachable, GoalUnreachable: names the limb and why, in the order given; with
            `accept_below_threshold`, why not even for less.
        TimeLimitReached, Cancelled: from the budget.
    """
    kind = StartUnreachable if which == "start" else GoalUnreachable
    q = generator.robot.reference.copy()
    q[generator.robot.root_index] = root
    if not generator.collision.root_free(q):
        raise kind("the root part of the robot collides with the environment")
    if not limbs:
        raise kind("no limb is to be in contact")
    orders = [(*limbs[turn:], *limbs[:turn]) for turn in range(len(limbs))]
    tries = [(least, order) for least in _enough(generator) for order in orders]
    failures: list[RootUnreachable] = []
    for least, order in tries:
        if budget is not None:
            budget.check("start", len(failures) / len(tries))
        try:
            found = _in_order(generator, q, order, least, kind)
        except RootUnreachable as error:
            failures.append(error)
            continue
        contacts = sorted(found.contacts, key=lambda contact: limbs.index(contact.limb))
        return replace(found, contacts=tuple(contacts))
    raise failures[-len(orders)]


def _enough(generator: ContactGenerator) -> tuple[float, ...]:
    """Least b0 of a start, newtons: what is asked for, then what is taken as a last resort."""
    if generator.floor < generator.threshold:
        return generator.threshold, generator.floor
    return (generator.threshold,)


def _in_order(
    generator: ContactGenerator,
    q: Array,
    limbs: Sequence[int],
    least: float,
    kind: type[StartUnreachable | GoalUnreachable],
) -> State:
    """The state that limbs lead to from a configuration (nq,), one after the other.

    Args:
        least: b0 that the whole set has to reach, newtons.

    Raises:
        StartUnreachable, GoalUnreachable: as `kind` says.
    """
    robot = generator.robot
    contacts: list[Contact] = []
    floor = least if generator.options.accept_below_threshold else None
    still = LookAhead.still(q[robot.root_index])
    for count, limb in enumerate(limbs, start=1):
        # Equilibrium is asked of the whole set only: two feet alone hold no quadruped.
        threshold = generator.threshold if count == len(limbs) else -np.inf
        found = generator.generate(q, limb, contacts, still, threshold=threshold, floor=floor)
        if isinstance(found, str):
            name = robot.limbs[limb].name
            raise kind(f"limb {name} finds no contact there ({found})", name)
        q, contact, _ = found
        contacts.append(contact)
    free = [k for k in range(len(robot.limbs)) if k not in limbs]
    for limb in free:
        if not generator.collision.limb_free(q, limb, None):
            name = robot.limbs[limb].name
            raise kind(f"limb {name}, at its reference posture, is in collision", name)
    value = generator.robustness(q, contacts)
    if value < least:
        raise kind(f"{len(contacts)} contacts hold it with robustness {value:.3g} N only")
    return generator.state(q, contacts, free, value)
