"""Errors as plain data, on their way from the worker process to the node's answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

from rbprm_core.errors import ErrorCode, InvalidInput, NoSequenceFound, RbprmError
from rbprm_core.failures import Cause
from rbprm_core.plan_record import ContactPlan

MAX_CHARACTERS = 200  # of an offending value; an answer must not grow with the invalid input


class NodeCode(IntEnum):
    """The node's own ways to fail; those of the core are below 100.

    The values are part of the interface: PlanningResult has the same.
    """

    PREEMPTED = 100
    OUTDATED = 101
    NOT_ACTIVE = 102
    UNKNOWN_SEQUENCE = 103
    WORKER_LOST = 104
    BUSY = 105


@dataclass(frozen=True)
class ErrorData:
    """The data of an error; `NO_ERROR` stands for success.

    Attributes:
        code: the way to fail.
        text: what happened and what to change.
        field: dotted path of the invalid input; "" unless the code is INVALID_INPUT or
            UNKNOWN_SEQUENCE.
        value: the invalid value as text; "" likewise.
        cause: why planning failed; UNSPECIFIED for errors of another kind.
        limb: name of the limb at fault; "" where no single limb is.
        state: index of the last state reached; -1 unless the code is NO_SEQUENCE.
        fraction: share of the guide that the sequence covers, 0 to 1.
    """

    code: ErrorCode | NodeCode
    text: str
    field: str = ""
    value: str = ""
    cause: Cause = Cause.UNSPECIFIED
    limb: str = ""
    state: int = -1
    fraction: float = 0.0


NO_ERROR = ErrorData(ErrorCode.SUCCESS, "", fraction=1.0)


class PlanningFailed(RbprmError):
    """The worker process ended some work with an error.

    Attributes:
        data: the data of the error.
        partial: plan of the states found until then; None where there are none.
    """

    def __init__(self, data: ErrorData, partial: ContactPlan | None = None) -> None:
        self.data, self.partial = data, partial
        super().__init__(data.text)


class NodeError(RbprmError):
    """A call that the node itself cannot serve.

    Args:
        code: the way to fail.
        text: what happened and what to change.
        field: dotted path of the invalid input; "" for none.
        value: the invalid value; "" for none.
        cause: why planning failed; UNSPECIFIED for errors of another kind.

    Attributes:
        data: the data of the error.
    """

    def __init__(
        self,
        code: NodeCode,
        text: str,
        field: str = "",
        value: str = "",
        cause: Cause = Cause.UNSPECIFIED,
    ) -> None:
        self.data = ErrorData(code, text, field, value[:MAX_CHARACTERS], cause)
        super().__init__(text)


def error_data(error: Exception) -> ErrorData:
    """The data of an error; the code of unforeseen errors is INTERNAL.

    Args:
        error: any exception of planning or serving.
    """
    text = str(error)
    match error:
        case PlanningFailed() | NodeError():
            return error.data
        case InvalidInput():
            return ErrorData(error.code, text, field=error.field, value=_shortened(error.value))
        case RbprmError():
            cause = Cause.UNSPECIFIED if error.failure is None else error.failure.cause
            data = ErrorData(error.code, text, cause=cause, limb=error.limb)
            if isinstance(error, NoSequenceFound):
                return replace(data, state=error.state, fraction=error.fraction)
            return data
    return ErrorData(ErrorCode.INTERNAL, f"a fault of the planner: {type(error).__name__}: {text}")


def _shortened(value: object) -> str:
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= MAX_CHARACTERS else f"{text[:MAX_CHARACTERS]}…"
