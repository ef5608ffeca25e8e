"""The independent check of a contact plan: it shares no code with the planner.

Kinematics and the robot's collision geometry come from the URDF through pinocchio, statics from an
own linear programme, collision from coal on the raw geometry. The bounds are those of the plan
file's description.
"""

from rbprm_core.check.report import CheckReport, Kind, Violation
from rbprm_core.check.runner import check_plan
from rbprm_core.check.sequence import transitions

__all__ = ["CheckReport", "Kind", "Violation", "check_plan", "transitions"]
