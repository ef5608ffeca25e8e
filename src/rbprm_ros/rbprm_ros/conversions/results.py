"""Outcomes of requests."""

from __future__ import annotations

from rbprm_msgs.msg import PlanningResult

from rbprm_ros.failure import SUCCEEDED, Failure


def result_message(failure: Failure = SUCCEEDED) -> PlanningResult:
    """How a request ended; by default in success."""
    return PlanningResult(
        code=int(failure.code),
        text=failure.text,
        field=failure.field,
        value=failure.value,
        limb=failure.limb,
        state=failure.state,
        fraction=failure.fraction,
    )
