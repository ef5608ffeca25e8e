"""What the check of a plan found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

PLAN = -1
"""State index of a violation that belongs to the plan and to no single state."""


class Kind(StrEnum):
    """The bounds that a plan can break."""

    NO_STATE = "no-state"
    JOINT_ORDER = "joint-order"
    QUATERNION = "quaternion"
    UNIT_NORMAL = "unit-normal"
    JOINT_LIMIT = "joint-limit"
    LIMB_TWICE = "limb-twice"
    CONTACT_POSE = "contact-pose"
    CONTACT_POINTS = "contact-points"
    OFF_ROBOT = "off-robot"
    OFF_ENVIRONMENT = "off-environment"
    OVERHANG = "overhang"
    FRICTION = "friction"
    NORMAL = "normal"
    COLLISION = "collision"
    SELF_COLLISION = "self-collision"
    COM = "com"
    STATICS = "statics"
    ROBUSTNESS = "robustness"
    CHANGES = "changes"
    KEPT_FRICTION = "kept-friction"
    DRIFT = "drift"
    START = "start"
    GOAL = "goal"


@dataclass(frozen=True)
class Violation:
    """One broken bound.

    Attributes:
        state: index of the state, of the later one for a pair of neighbours; `PLAN` for the plan.
        limb: limb of the contact at fault, "" where no single contact is.
        kind: which bound.
        text: what was found and what the bound is.
    """

    state: int
    limb: str
    kind: str
    text: str

    def __str__(self) -> str:
        where = "plan" if self.state == PLAN else f"state {self.state}"
        return f"{where}, limb {self.limb}: {self.text}" if self.limb else f"{where}: {self.text}"


@dataclass(frozen=True)
class TransitionSupport:
    """Transitions by the ends at which the robot stands without the moving contact.

    Standing is static equilibrium, b0 >= 0, on the contacts common to both states.

    Attributes:
        both, one, neither: number of transitions; together all of them.
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
    """Outcome of the check of one plan.

    Figures that break no bound by themselves stand beside the violations: how the transitions are
    supported, and which limbs that were to be in contact at the goal are not.

    Attributes:
        violations: every broken bound, the plan's own first, then by state.
        states: number of states.
        transitions: number of neighbouring states between which a contact changes.
        robustness: recomputed b0 of every state, newtons; -inf where no forces hold the robot.
        deepest_collision: greatest depth against the environment that was met, metres.
        overhanging: number of contacts of states whose patch lies only in part on the environment;
            each is a violation too.
        unsupported: greatest share of a patch's area that lies on nothing, 0 to 1.
        goal_limbs: limbs that were to be in contact in the last state; None where any were good.
        goal_missing: those of them that are not.
        support: the transitions by where the robot stands without the moving contact.
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
        """Whether every bound holds."""
        return not self.violations

    @property
    def min_robustness(self) -> float:
        """Least recomputed b0 of all states, newtons; -inf for a plan without states."""
        return min(self.robustness, default=float("-inf"))

    def document(self) -> dict[str, Any]:
        """The report as JSON has it: newtons and metres, null for an infinite number."""
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
    """What the check measures beside its bounds, in words by name."""
    overhang = str(report.overhanging)
    if report.overhanging:
        overhang += f", up to {report.unsupported:.1%} of the patch"
    goal = "as asked for"
    if report.goal_limbs is None:
        goal = "none asked for"
    elif report.goal_missing:
        goal = f"missing {', '.join(report.goal_missing)}"
    return {
        "overhanging patches": overhang,
        "contacts at the goal": goal,
        "stable transitions": str(report.support),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
