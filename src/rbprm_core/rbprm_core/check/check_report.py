"""The report of a check: violations, and figures that break no bound by themselves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rbprm_core.check.violation import Violation


@dataclass(frozen=True)
class TransitionSupport:
    r"""Transitions by the ends at which the robot is stable without the moving contact.

    Stable means static equilibrium, $b_0 \geq 0$, on the contacts common to both states.

    Attributes:
        both: number of transitions that are stable at both ends.
        one: number of transitions that are stable at one end.
        neither: number of transitions that are stable at neither end.
    """

    both: int
    one: int
    neither: int

    def __str__(self) -> str:
        count = max(self.both + self.one + self.neither, 1)
        parts = {"both ends": self.both, "one": self.one, "neither": self.neither}
        shares = ", ".join(f"{name} {number / count:.0%}" for name, number in parts.items())
        return f"at {shares}, without the moving contact"


@dataclass(frozen=True)
class CheckReport:
    """Result of the check of one plan.

    Attributes:
        violations: every broken bound, those of the whole plan first, then by state.
        states: number of states.
        transitions: number of pairs of neighbouring states between which a contact changes.
        robustness: recomputed $b_0$ of every state, newtons; minus infinity where no contact forces
            balance the robot.
        deepest_collision: greatest penetration depth into the environment, metres.
        overhanging: number of contacts, over all states, whose patch lies only in part on the
            environment. Each is a violation too.
        unsupported: greatest share of a patch's area that is off the environment, 0 to 1.
        goal_limbs: names of the limbs requested to be in contact in the last state; None where any
            limbs were allowed.
        goal_missing: those of `goal_limbs` that are not in contact in the last state.
        support: number of transitions by the ends at which the robot is stable without the moving
            contact.
    """

    violations: tuple[Violation, ...]
    states: int
    transitions: int
    robustness: tuple[float, ...]
    deepest_collision: float
    overhanging: int
    unsupported: float
    goal_limbs: tuple[str, ...] | None
    goal_missing: tuple[str, ...]
    support: TransitionSupport

    @property
    def valid(self) -> bool:
        """Whether the plan breaks no bound."""
        return not self.violations

    @property
    def min_robustness(self) -> float:
        """Smallest recomputed $b_0$ of all states, newtons; minus infinity without states."""
        return min(self.robustness, default=float("-inf"))

    def document(self) -> dict[str, Any]:
        """Return the report for JSON: newtons, metres, null for an infinite number."""
        return {
            "valid": self.valid,
            "violations": [
                {"state": v.state, "limb": v.limb, "kind": str(v.kind), "text": v.text}
                for v in self.violations
            ],
            "states": self.states,
            "robustness": [_finite(value) for value in self.robustness],
            "min_robustness": _finite(self.min_robustness),
            "deepest_collision": self.deepest_collision,
            "overhanging": {"contacts": self.overhanging, "greatest_share": self.unsupported},
            "goal_contacts": {
                "asked": self.goal_limbs,
                "missing": self.goal_missing,
                "reached": None if self.goal_limbs is None else not self.goal_missing,
            },
            "transitions": {
                "count": self.transitions,
                "stable_without_moving_contact": {
                    "both_ends": self.support.both,
                    "one_end": self.support.one,
                    "neither_end": self.support.neither,
                },
            },
        }


def figures(report: CheckReport) -> dict[str, str]:
    """Return the figures that the check measures beside its bounds, as text by name.

    Args:
        report: report of a check.
    """
    overhang = str(report.overhanging)
    if report.overhanging:
        overhang += f", up to {report.unsupported:.1%} of the patch"
    goal = "as requested"
    if report.goal_limbs is None:
        goal = "none requested"
    elif report.goal_missing:
        goal = f"missing {', '.join(report.goal_missing)}"
    return {
        "overhanging patches": overhang,
        "contacts at the goal": goal,
        "stable transitions": str(report.support),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
