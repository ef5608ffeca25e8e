"""One tree of errors. Each carries its data, and its text says what to change."""

from __future__ import annotations

from enum import IntEnum
from typing import Any


class ErrorCode(IntEnum):
    """The ways to fail. Values are part of the interface: messages and exit codes use them."""

    SUCCESS = 0
    INTERNAL = 1
    INVALID_INPUT = 2
    START_UNREACHABLE = 3
    GOAL_UNREACHABLE = 4
    NO_GUIDE = 5
    NO_SEQUENCE = 6
    TIME_LIMIT = 7
    CANCELLED = 8


class RbprmError(Exception):
    """Root of every error that this package raises on purpose.

    Attributes:
        statistics: `plan_record.Statistics` of the planning that the error ended, or None.
        states: those of the contact sequence that were found until then, a partial result.
        fraction: share of their guide that these states cover, 0 to 1.
    """

    code = ErrorCode.INTERNAL
    statistics: Any = None
    states: tuple[Any, ...] = ()
    fraction = 0.0

    def __reduce__(self) -> tuple[Any, ...]:
        """For the way from one process to another: pickle would call `__init__` with the text."""
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
        if len(shown) > 200:
            shown = f"{shown[:200]}… ({len(shown)} characters)"
        super().__init__(f"{field} = {shown}: {reason}")


ROOT_REMEDIES = (
    ("equilibrium", "lower the robustness threshold, move the root, or put other limbs in contact"),
    ("robustness", "lower the robustness threshold, move the root, or put other limbs in contact"),
    ("weight", "move the root, or require more limbs"),
    ("obstacle", "move the root out of it"),
    ("colli", "move the root away from what it collides with"),
    ("carries", "begin from a state whose contacts are there, or send their surfaces"),
    ("is to be in contact", "name limbs in contact"),
    ("", "move the root, put fewer limbs in contact, or send more surfaces"),
)
"""What to change, by what a reason contains: the first that fits."""

SEQUENCE_REMEDIES = (
    ("equilibrium", "lower the robustness threshold, or try another seed or more guides"),
    ("robustness", "lower the robustness threshold, or try another seed or more guides"),
    ("", "try another seed, more guides, or a smaller sequence.min_step"),
)
"""As above, of a sequence that stopped."""


def _remedy(remedies: tuple[tuple[str, str], ...], reason: str) -> str:
    return next(remedy for part, remedy in remedies if part in reason)


class RootUnreachable(RbprmError):
    """No contact configuration exists at a root placement that was asked for."""

    def __init__(self, which: str, reason: str, limb: str = "") -> None:
        self.which, self.reason, self.limb = which, reason, limb
        super().__init__(
            f"the {which} is not reachable: {reason}: {_remedy(ROOT_REMEDIES, reason)}"
        )


class StartUnreachable(RootUnreachable):
    """The start root placement admits no contact configuration."""

    code = ErrorCode.START_UNREACHABLE

    def __init__(self, reason: str, limb: str = "") -> None:
        super().__init__("start", reason, limb)


class GoalUnreachable(RootUnreachable):
    """The goal root placement admits no contact configuration."""

    code = ErrorCode.GOAL_UNREACHABLE

    def __init__(self, reason: str, limb: str = "") -> None:
        super().__init__("goal", reason, limb)


class NoGuideFound(RbprmError):
    """P1 ended without a path of the root."""

    code = ErrorCode.NO_GUIDE

    def __init__(self, reason: str, nodes: int = 0) -> None:
        self.reason, self.nodes = reason, nodes
        super().__init__(f"no guide path found: {reason}")


class NoSequenceFound(RbprmError):
    """P2 stopped before the goal.

    Attributes:
        state: index of the last state reached.
        limb: limb that could not be placed ("" where no single limb is to blame).
        reason: why.
        fraction: share of the guide that was covered, 0 to 1.
        states: the states up to there, a partial result.
        where: text of where it stopped and why, without what to change.
    """

    code = ErrorCode.NO_SEQUENCE

    def __init__(
        self, state: int, limb: str, reason: str, fraction: float, states: tuple[Any, ...] = ()
    ) -> None:
        self.state, self.limb, self.reason = state, limb, reason
        self.fraction, self.states = fraction, states
        who = f" at limb {limb}" if limb else ""
        self.where = f"stopped after state {state}{who}, {fraction:.0%} of the guide: {reason}"
        remedy = _remedy(SEQUENCE_REMEDIES, reason)
        super().__init__(f"no contact sequence found: {self.where}: {remedy}")


class TimeLimitReached(RbprmError):
    """The time limit of the request ran out.

    Attributes:
        best: the failure of the attempt that came farthest, None where none had ended.
    """

    code = ErrorCode.TIME_LIMIT

    def __init__(self, limit: float, stage: str, best: NoSequenceFound | None = None) -> None:
        self.limit, self.stage, self.best = limit, stage, best
        before = f" (best attempt before: {best.where})" if best is not None else ""
        super().__init__(
            f"time limit of {limit:g} s reached in stage {stage}: "
            f"raise the limit or ease the request{before}"
        )


class Cancelled(RbprmError):
    """The caller asked to stop."""

    code = ErrorCode.CANCELLED

    def __init__(self, stage: str) -> None:
        self.stage = stage
        super().__init__(f"cancelled in stage {stage}")
