"""The independent check of a contact plan, which shares no code with the planner.

Kinematics and the robot's collision geometry come from the URDF through pinocchio, statics from a
separate linear program, and collisions from coal on the unsimplified meshes. The bounds are those
of the plan file's description.
"""

from rbprm_core.check.check_report import CheckReport, TransitionSupport, figures
from rbprm_core.check.contact_changes import count_transitions
from rbprm_core.check.runner import check_plan
from rbprm_core.check.start_and_goal import missing_goal_limbs
from rbprm_core.check.violation import Kind, Violation

__all__ = [
    "CheckReport",
    "Kind",
    "TransitionSupport",
    "Violation",
    "check_plan",
    "count_transitions",
    "figures",
    "missing_goal_limbs",
]
