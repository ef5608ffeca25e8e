"""Replanning after changes of the environment: validity, decision, and the new part."""

from rbprm_core.plan_conversion.plan_to_states import (
    root_placement,
    state_from_plan,
    states_from_plan,
)
from rbprm_core.replanning.policy import Decision, Keep, Replan, Situation, Stuck, decide
from rbprm_core.replanning.replan import Revision, replan, replan_from_one_of
from rbprm_core.replanning.validity import InvalidState, Reason, ValidityMonitor

__all__ = [
    "Decision",
    "InvalidState",
    "Keep",
    "Reason",
    "Replan",
    "Revision",
    "Situation",
    "Stuck",
    "ValidityMonitor",
    "decide",
    "replan",
    "replan_from_one_of",
    "root_placement",
    "state_from_plan",
    "states_from_plan",
]
