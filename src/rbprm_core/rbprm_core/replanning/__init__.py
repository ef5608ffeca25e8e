"""Going on from a plan whose surroundings changed: what still holds, from where, and how."""

from rbprm_core.replanning.policy import Decision, Keep, Replan, Situation, Stuck, decide
from rbprm_core.replanning.replan import Revision, replan, replan_from_one_of
from rbprm_core.replanning.restore import restored_state, restored_states, root_placement
from rbprm_core.replanning.validity import InvalidState, Reason, Watch

__all__ = [
    "Decision",
    "InvalidState",
    "Keep",
    "Reason",
    "Replan",
    "Revision",
    "Situation",
    "Stuck",
    "Watch",
    "decide",
    "replan",
    "replan_from_one_of",
    "restored_state",
    "restored_states",
    "root_placement",
]
