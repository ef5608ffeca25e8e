"""Outcomes of requests."""

from __future__ import annotations

from dataclasses import replace

from rbprm_msgs.msg import PlanningResult

from rbprm_core.check import missing_goal_limbs
from rbprm_core.contacts.continuation import ROUNDING
from rbprm_core.plan_record import ContactPlan
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


def success_message(plan: ContactPlan) -> PlanningResult:
    """Success; the text says what the plan lacks of what was asked for."""
    lacks = [text for text in (_weak(plan), _goal_missed(plan)) if text]
    return result_message(replace(SUCCEEDED, text="; ".join(lacks)))


def _weak(plan: ContactPlan) -> str:
    """What there is to say of states under the threshold; "" where there are none."""
    asked = plan.request.robustness_threshold
    least = min((state.robustness for state in plan.states), default=asked)
    if least >= asked - ROUNDING:
        return ""
    return (
        f"the least robustness is {least:.3g} N, under the {asked:g} N asked for, as the parameter "
        "generator.accept_below_threshold allows"
    )


def _goal_missed(plan: ContactPlan) -> str:
    """What there is to say of limbs that are not in contact at the goal; "" where all are."""
    missing = missing_goal_limbs(plan)
    if not missing:
        return ""
    return f"not in contact in the last state, as goal_limbs asks: {', '.join(missing)}"
