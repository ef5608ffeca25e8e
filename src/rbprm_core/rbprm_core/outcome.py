"""The result of planning, before it becomes a plan record."""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.body.state import State
from rbprm_core.guide.protocol import Guide
from rbprm_core.plan_record import Statistics


@dataclass(frozen=True, eq=False)
class Outcome:
    """A guide and a contact sequence along it.

    Attributes:
        guide: path of the root.
        states: contact states, start first.
        statistics: seconds by stage, counts, and versions of the packages that took part.
    """

    guide: Guide
    states: tuple[State, ...]
    statistics: Statistics
