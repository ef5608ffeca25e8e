"""From errors and violations to run failures that can be counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rbprm_core.bench.record import INVALID_PLAN, RunFailure
from rbprm_core.check import Violation
from rbprm_core.errors import ErrorCode, InvalidInput, RbprmError, TimeLimitReached
from rbprm_core.failures import Failure


def failure_of(error: Exception) -> RunFailure:
    """The run failure of an error; an error of another package counts as INTERNAL.

    Args:
        error: the error that ended the run.
    """
    if not isinstance(error, RbprmError):
        name = type(error).__name__
        return RunFailure(ErrorCode.INTERNAL.name, name, "", f"{name}: {error}")
    code, cause = error.code.name, _cause(error.failure)
    if isinstance(error, TimeLimitReached):
        cause = f"stage {error.stage}" if not cause else f"stage {error.stage}, {cause}"
    elif isinstance(error, InvalidInput):
        cause = error.field
    return RunFailure(code, cause, error.limb, str(error))


def failure_of_check(violations: Sequence[Violation]) -> RunFailure | None:
    """The run failure of a plan that the check refuses, None of a valid one.

    Its limb is that of the first violation, its cause lists the kinds of all violations.

    Args:
        violations: violations that the check found.
    """
    if not violations:
        return None
    first = violations[0]
    kinds = Counter(str(violation.kind) for violation in violations)
    return RunFailure(INVALID_PLAN, ", ".join(sorted(kinds)), first.limb, str(first))


def _cause(failure: Failure | None) -> str:
    return "" if failure is None else failure.cause.name.lower()
