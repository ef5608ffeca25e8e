"""Violations: bounds that a plan breaks."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

PLAN = -1
"""State index of violations that belong to the whole plan and not to one state."""


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
        state: index of the state, or of the later one of two neighbours; `PLAN` for the whole plan.
        limb: name of the limb whose contact breaks the bound; "" where it is not a single contact.
        kind: kind of the bound.
        text: the value found and the bound, for a reader.
    """

    state: int
    limb: str
    kind: str
    text: str

    def __str__(self) -> str:
        where = "plan" if self.state == PLAN else f"state {self.state}"
        return f"{where}, limb {self.limb}: {self.text}" if self.limb else f"{where}: {self.text}"
