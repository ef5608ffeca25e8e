"""From errors and violations to causes that can be counted."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from rbprm_core.bench.record import INVALID_PLAN, Failure
from rbprm_core.check import Violation
from rbprm_core.errors import (
    ErrorCode,
    InvalidInput,
    NoGuideFound,
    NoSequenceFound,
    RbprmError,
    RootUnreachable,
    TimeLimitReached,
)

NUMBER = re.compile(r"(?<![\w.])-?(inf|\d+(\.\d+)?(e[+-]?\d+)?)(?!\w)")


def failure_of(error: Exception) -> Failure:
    """The failure that an error stands for; one that is not ours is a fault."""
    if not isinstance(error, RbprmError):
        return Failure(ErrorCode.INTERNAL.name, "", f"{type(error).__name__}: {error}")
    code = error.code.name
    match error:
        case NoSequenceFound() | RootUnreachable():
            return Failure(code, error.limb, error.reason)
        case NoGuideFound():
            return Failure(code, "", error.reason)
        case TimeLimitReached(best=None):
            return Failure(code, "", f"in stage {error.stage}")
        case TimeLimitReached(best=NoSequenceFound() as best):
            return Failure(code, best.limb, f"in stage {error.stage}, before: {best.reason}")
        case InvalidInput():
            return Failure(code, "", f"{error.field}: {error.reason}")
    return Failure(code, "", str(error))


def failure_of_check(violations: Sequence[Violation]) -> Failure | None:
    """The failure of a plan that breaks bounds: its limb and kind are the first violation's."""
    if not violations:
        return None
    first = violations[0]
    kinds = Counter(str(violation.kind) for violation in violations)
    return Failure(INVALID_PLAN, first.limb, ", ".join(sorted(kinds)))


def group(failure: Failure) -> Failure:
    """The failure without its numbers, equal for all runs that failed in the same way."""
    return Failure(failure.code, failure.limb, NUMBER.sub("…", failure.reason))
