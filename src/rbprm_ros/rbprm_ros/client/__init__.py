"""A client of the planner for mission executives, and an example of an executive."""

from rbprm_ros.client.plan_call import PlanCall
from rbprm_ros.client.planner_client import PlannerClient, PlannerTimeout

__all__ = ["PlanCall", "PlannerClient", "PlannerTimeout"]
