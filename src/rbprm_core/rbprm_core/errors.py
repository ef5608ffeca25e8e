"""One tree of errors. Each carries its data; its text says what happened and what to change."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from rbprm_core.failure_text import (
    GUIDE_REMEDY,
    failure_text,
    root_remedy,
    sequence_remedy,
)
from rbprm_core.failures import Failure


class ErrorCode(IntEnum):
    """The ways to fail. The values are part of the interface: messages and exit codes use them.

    Values up to 99 belong to this package; those of the ROS node begin at 100.
    """

    SUCCESS = 0
    INTERNAL = 1
    INVALID_INPUT = 2
    START_UNREACHABLE = 3
    GOAL_UNREACHABLE = 4
    NO_GUIDE = 5
    NO_SEQUENCE = 6
    TIME_LIMIT = 7
    CANCELLED = 8


MAX_SHOWN = 200  # characters of an offending value in an error text


class RbprmError(Exception):
    """Root of every error that this package raises on purpose.

    Attributes:
        code: the way to fail.
        failure: cause and fields of a planning failure; None for errors of another kind.
        statistics: `rbprm_core.plan_record.Statistics` of the planning that the error ended, None
            where it ended none.
        states: states of the contact sequence that were found until then, a partial result.
        fraction: share of the guide that these states cover, 0 to 1.
    """

    code = ErrorCode.INTERNAL
    failure: Failure | None = None
    statistics: Any = None
    states: tuple[Any, ...] = ()
    fraction = 0.0

    @property
    def limb(self) -> str:
        """Name of the limb at fault, "" where no single limb is."""
        return "" if self.failure is None else self.failure.limb

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by type and data; the default would call `__init__` with the text alone."""
        return _restored, (type(self), self.args, self.__dict__)


def _restored(kind: type[RbprmError], args: tuple[Any, ...], data: dict[str, Any]) -> RbprmError:
    error = kind.__new__(kind, *args)
    error.__dict__.update(data)
    return error


class InvalidInput(RbprmError):
    """A value from outside cannot be used.

    Attributes:
        field: dotted path of the field, as the user wrote it.
        value: the offending value.
        reason: what is wrong and what would be right.
    """

    code = ErrorCode.INVALID_INPUT

    def __init__(self, field: str, value: Any, reason: str) -> None:
        self.field, self.value, self.reason = field, value, reason
        shown = repr(value)
        if len(shown) > MAX_SHOWN:
            shown = f"{shown[:MAX_SHOWN]}… ({len(shown)} characters)"
        super().__init__(f"{field} = {shown}: {reason}")


class RootUnreachable(RbprmError):
    """No contact state exists at the requested start or goal of the root.

    Args:
        which: "start" or "goal".
        failure: why there is none.
    """

    failure: Failure

    def __init__(self, which: str, failure: Failure) -> None:
        self.which, self.failure = which, failure
        text = failure_text(failure)
        super().__init__(f"the {which} is not reachable: {text}: {root_remedy(failure)}")


class StartUnreachable(RootUnreachable):
    """No contact state exists at the start of the root.

    Args:
        failure: why there is none.
    """

    code = ErrorCode.START_UNREACHABLE

    def __init__(self, failure: Failure) -> None:
        super().__init__("start", failure)


class GoalUnreachable(RootUnreachable):
    """No contact state exists at the goal of the root.

    Args:
        failure: why there is none.
    """

    code = ErrorCode.GOAL_UNREACHABLE

    def __init__(self, failure: Failure) -> None:
        super().__init__("goal", failure)


class NoGuideFound(RbprmError):
    """The guide planner (P1) ended without a path of the root.

    Args:
        failure: why there is none.
        nodes: number of nodes of the search.
    """

    code = ErrorCode.NO_GUIDE
    failure: Failure

    def __init__(self, failure: Failure, nodes: int = 0) -> None:
        self.failure, self.nodes = failure, nodes
        super().__init__(f"no guide path found: {failure_text(failure)}: {GUIDE_REMEDY}")


class NoSequenceFound(RbprmError):
    """The contact planner (P2) stopped before the goal.

    Args:
        state: index of the last state reached.
        failure: why no further state was found.
        fraction: share of the guide that was covered, 0 to 1.
        states: the states up to there, a partial result.
    """

    code = ErrorCode.NO_SEQUENCE
    failure: Failure

    def __init__(
        self, state: int, failure: Failure, fraction: float, states: tuple[Any, ...] = ()
    ) -> None:
        self.state, self.failure = state, failure
        self.fraction, self.states = fraction, states
        super().__init__(f"no contact sequence found: {self.summary}: {sequence_remedy(failure)}")

    @property
    def summary(self) -> str:
        """Where the sequence stopped and why, without what to change."""
        text = failure_text(self.failure)
        return f"stopped after state {self.state}, {self.fraction:.0%} of the guide: {text}"


class TimeLimitReached(RbprmError):
    """The time limit of the request ran out.

    Args:
        limit: the time limit, seconds.
        stage: name of the stage in which it ran out, a `rbprm_core.stages.Stage`.
        best: failure of the attempt that covered the largest share of its guide, None where no
            attempt had ended.
    """

    code = ErrorCode.TIME_LIMIT

    def __init__(self, limit: float, stage: str, best: NoSequenceFound | None = None) -> None:
        self.limit, self.stage, self.best = limit, stage, best
        self.failure = None if best is None else best.failure
        before = f" (best attempt before: {best.summary})" if best is not None else ""
        super().__init__(
            f"time limit of {limit:g} s reached in stage {stage}: "
            f"raise the limit or ease the request{before}"
        )


class Cancelled(RbprmError):
    """The caller requested a stop.

    Args:
        stage: name of the stage that was stopped, a `rbprm_core.stages.Stage`.
    """

    code = ErrorCode.CANCELLED

    def __init__(self, stage: str) -> None:
        self.stage = stage
        super().__init__(f"cancelled in stage {stage}")
