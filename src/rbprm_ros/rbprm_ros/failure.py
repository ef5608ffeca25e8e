"""How a request failed, as plain data: from the planning process to the node's answer."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import IntEnum

from rbprm_core.errors import ErrorCode, InvalidInput, NoSequenceFound, RbprmError, RootUnreachable
from rbprm_core.plan_record import ContactPlan

STATE = re.compile(r"(measured_state|sequence\.states)\.")
MAX_CHARACTERS = 200  # of an offending value; an answer must not grow with the input at fault


class NodeCode(IntEnum):
    """The node's own ways to fail, after those of the core; PlanningResult has the same."""

    PREEMPTED = 9
    OUTDATED = 10
    NOT_ACTIVE = 11
    UNKNOWN_SEQUENCE = 12
    WORKER_LOST = 13
    BUSY = 14


@dataclass(frozen=True)
class Failure:
    """The data of an error.

    Attributes:
        code: the way to fail. text: what happened and what to change.
        field, value: what was wrong in the input; "" unless the code is INVALID_INPUT or
            UNKNOWN_SEQUENCE.
        limb: that could not be placed; "" where no single limb is to blame.
        state: index of the last state reached; -1 unless the code is NO_SEQUENCE.
        fraction: share of the guide that the sequence covered, 0 to 1.
    """

    code: ErrorCode | NodeCode
    text: str
    field: str = ""
    value: str = ""
    limb: str = ""
    state: int = -1
    fraction: float = 0.0


SUCCEEDED = Failure(ErrorCode.SUCCESS, "", fraction=1.0)


class PlanningFailed(RbprmError):
    """The planning process ended a job with a failure.

    Attributes:
        partial: the states up to where it ended, as a plan; None where there are none.
    """

    def __init__(self, failure: Failure, partial: ContactPlan | None = None) -> None:
        self.record, self.partial = failure, partial
        super().__init__(failure.text)


class NodeError(RbprmError):
    """A call that the node itself cannot serve."""

    def __init__(self, code: NodeCode, text: str, field: str = "", value: str = "") -> None:
        self.record = Failure(code, text, field, value[:MAX_CHARACTERS])
        super().__init__(text)


def failure_of(error: Exception) -> Failure:
    """The data of an error; one that nobody foresaw is INTERNAL."""
    text = str(error)
    match error:
        case PlanningFailed() | NodeError():
            return error.record
        case InvalidInput():
            told = InvalidInput(_field_of_messages(error.field), error.value, error.reason)
            return Failure(error.code, str(told), field=told.field, value=_shown(error.value))
        case RootUnreachable():
            return Failure(error.code, text, limb=error.limb)
        case NoSequenceFound():
            where = {"limb": error.limb, "state": error.state, "fraction": error.fraction}
            return Failure(error.code, text, **where)  # type: ignore[arg-type]
        case RbprmError():
            return Failure(error.code, text)
    return Failure(ErrorCode.INTERNAL, f"a fault of the planner: {type(error).__name__}: {text}")


def _field_of_messages(field: str) -> str:
    """A field of a state in the words of ContactState, not in those of the plan file."""
    if STATE.match(field) is None:
        return field
    field = re.sub(r"\.joints\b", ".joint_positions", field)
    field = re.sub(r"(\.contacts\.\d+)\.(position|orientation)\b", r"\1.pose.\2", field)
    return re.sub(r"\.surface$", ".surface_id", field)


def _shown(value: object) -> str:
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= MAX_CHARACTERS else f"{text[:MAX_CHARACTERS]}…"
