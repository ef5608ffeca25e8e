"""Stability of the robot without the moving contact at both ends of each transition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.check.check_report import TransitionSupport
from rbprm_core.check.static_equilibrium import SOLVER_SLACK, state_robustness
from rbprm_core.plan_record import ContactEntry


@dataclass(frozen=True, eq=False)
class TransitionEnd:
    """The state at one end of a transition.

    Attributes:
        contacts: contacts of the state.
        com: (3,) centre of mass of the state, metres, planning frame.
    """

    contacts: Sequence[ContactEntry]
    com: Array


class SupportCounter:
    """Counts transitions by the ends at which the contacts common to both ends hold the robot.

    A swing limb carries no load, so that only the stance limbs hold the robot. If they hold it at
    one end, the root can stay there while the limb moves.

    Args:
        load: (3,) weight, newtons, planning frame.
        grip_force: sum of the force coefficients where there is no weight, newtons.
    """

    def __init__(self, load: Array, grip_force: float) -> None:
        self._load, self._grip_force = load, grip_force
        self._slack = SOLVER_SLACK * (float(np.linalg.norm(load)) or grip_force)
        self._ends = [0, 0, 0]  # transitions by the number of stable ends

    @property
    def total(self) -> TransitionSupport:
        """Numbers of transitions counted so far."""
        neither, one, both = self._ends
        return TransitionSupport(both=both, one=one, neither=neither)

    def add(self, before: TransitionEnd, after: TransitionEnd, changed: Sequence[str]) -> None:
        """Count a transition.

        Args:
            before: state before the transition.
            after: state after the transition.
            changed: names of the limbs that change their contact.
        """
        self._ends[sum(self._is_stable(end, changed) for end in (before, after))] += 1

    def _is_stable(self, end: TransitionEnd, changed: Sequence[str]) -> bool:
        """Return whether the contacts of the other limbs hold the robot at one end."""
        kept = [contact for contact in end.contacts if contact.limb not in changed]
        b0, _ = state_robustness(kept, end.com, self._load, self._grip_force)
        return b0 >= -self._slack
