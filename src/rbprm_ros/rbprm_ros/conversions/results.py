"""Results of requests as messages."""

from __future__ import annotations

from dataclasses import replace

from rbprm_msgs.msg import PlanningResult

from rbprm_core.check import missing_goal_limbs
from rbprm_core.contacts.continuation import ROUNDING
from rbprm_core.plan_record import ContactPlan
from rbprm_ros.errors import NO_ERROR, ErrorData


def result_message(error: ErrorData = NO_ERROR) -> PlanningResult:
    """The message of an error; by default of success.

    Args:
        error: data of the error.
    """
    return PlanningResult(
        code=int(error.code),
        text=error.text,
        field=error.field,
        value=error.value,
        cause=int(error.cause),
        limb=error.limb,
        state=error.state,
        fraction=error.fraction,
    )


def success_message(plan: ContactPlan) -> PlanningResult:
    """The message of a success; its text says what the plan lacks of the request.

    Args:
        plan: the plan.
    """
    texts = [text for text in (_low_robustness(plan), _missing_limbs(plan)) if text]
    return result_message(replace(NO_ERROR, text="; ".join(texts)))


def _low_robustness(plan: ContactPlan) -> str:
    """Text about states below the robustness threshold; "" where there are none."""
    threshold = plan.request.robustness_threshold
    minimum = min((state.robustness for state in plan.states), default=threshold)
    if minimum >= threshold - ROUNDING:
        return ""
    return (
        f"the minimum robustness is {minimum:.3g} N, below the requested {threshold:g} N, as the "
        "parameter generator.accept_below_threshold allows"
    )


def _missing_limbs(plan: ContactPlan) -> str:
    """Text about limbs that are not in contact at the goal; "" where all are."""
    missing = missing_goal_limbs(plan)
    if not missing:
        return ""
    return f"limbs of goal_limbs without contact in the last state: {', '.join(missing)}"
