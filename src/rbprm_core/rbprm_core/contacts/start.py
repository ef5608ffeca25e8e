"""The contact state at a given root: the first of the sequence, or a test of the goal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.contacts.generator import ContactGenerator
from rbprm_core.contacts.look_ahead import LookAhead
from rbprm_core.contacts.state import Contact, State
from rbprm_core.errors import GoalUnreachable, StartUnreachable

Array = NDArray[np.float64]


def start_state(
    generator: ContactGenerator,
    root: Array,
    limbs: Sequence[int],
    which: str = "start",
    budget: Budget | None = None,
) -> State:
    """A state in static equilibrium with given limbs in contact, from the reference posture.

    Args:
        root: (7 + j,) root configuration. limbs: indices of the limbs that must be in contact.
        which: "start" or "goal", for the error.

    Raises:
        StartUnreachable, GoalUnreachable: names the limb and why.
        TimeLimitReached, Cancelled: from the budget.
    """
    kind = StartUnreachable if which == "start" else GoalUnreachable
    robot = generator.robot
    q = robot.reference.copy()
    q[robot.root_index] = root
    if not generator.collision.root_free(q):
        raise kind("the root part of the robot collides with the environment")
    contacts: list[Contact] = []
    floor = generator.floor if generator.options.most_robust else None
    still = LookAhead.still(root)
    for count, limb in enumerate(limbs, start=1):
        if budget is not None:
            budget.check("start", (count - 1) / len(limbs))
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
    if value < generator.floor or not contacts:
        raise kind(f"{len(contacts)} contacts hold it with robustness {value:.3g} N only")
    return generator.state(q, contacts, free, value)
