"""What the check of a plan found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

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
    OFF_ENVIRONMENT = "off-environment"
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
class CheckReport:
    """Outcome of the check of one plan.

    Attributes:
        violations: every broken bound, the plan's own first, then by state.
        states: number of states.
        transitions: number of neighbouring states between which a contact changes.
        robustness: recomputed b0 of every state, newtons; -inf where no forces hold the robot.
        deepest_collision: greatest depth against the environment that was met, metres.
    """

    violations: tuple[Violation, ...]
    states: int
    transitions: int
    robustness: tuple[float, ...]
    deepest_collision: float

    @property
    def valid(self) -> bool:
        """Whether every bound holds."""
        return not self.violations

    @property
    def least_robustness(self) -> float:
        """Least recomputed b0 of all states, newtons; -inf for a plan without states."""
        return min(self.robustness, default=float("-inf"))
