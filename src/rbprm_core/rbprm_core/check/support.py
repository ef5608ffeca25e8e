"""Whether the robot stands without the contact that changes, at either end of a transition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbprm_core.check.report import TransitionSupport
from rbprm_core.check.statics import SOLVER_SLACK, state_robustness
from rbprm_core.plan_record import ContactEntry


@dataclass(frozen=True, eq=False)
class End:
    """One end of a transition.

    Attributes:
        contacts: of the state. com: (3,) its centre of mass, metres.
    """

    contacts: Sequence[ContactEntry]
    com: NDArray[np.float64]


class SupportCount:
    """Counts transitions by the ends at which the contacts common to both hold the robot.

    While a limb moves it bears nothing, so only the others hold the robot. What they can hold at
    one end at least can be held somewhere on the way: the root may be there while the limb moves.

    Args:
        load: weight (3,), newtons. grip_force: sum of the forces where there is no weight, newtons.
    """

    def __init__(self, load: NDArray[np.float64], grip_force: float) -> None:
        self._load, self._grip_force = load, grip_force
        self._slack = SOLVER_SLACK * (float(np.linalg.norm(load)) or grip_force)
        self._ends = [0, 0, 0]  # transitions by the number of ends

    @property
    def total(self) -> TransitionSupport:
        """The transitions counted so far."""
        neither, one, both = self._ends
        return TransitionSupport(both=both, one=one, neither=neither)

    def add(self, before: End, after: End, changed: Sequence[str]) -> None:
        """Count a transition between two states in which some limbs change their contact."""
        self._ends[sum(self._stands(end, changed) for end in (before, after))] += 1

    def _stands(self, end: End, changed: Sequence[str]) -> bool:
        kept = [contact for contact in end.contacts if contact.limb not in changed]
        b0, _ = state_robustness(kept, end.com, self._load, self._grip_force)
        return b0 >= -self._slack
