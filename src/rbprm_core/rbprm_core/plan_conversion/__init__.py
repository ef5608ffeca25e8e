"""Conversion between the planner's states and the records of a plan, in both directions."""

from rbprm_core.plan_conversion.plan_to_states import (
    StateFields,
    root_placement,
    state_from_plan,
    states_from_plan,
)
from rbprm_core.plan_conversion.states_to_plan import (
    contact_plan,
    partial_plan,
    state_entry,
    with_states,
)

__all__ = [
    "StateFields",
    "contact_plan",
    "partial_plan",
    "root_placement",
    "state_entry",
    "state_from_plan",
    "states_from_plan",
    "with_states",
]
