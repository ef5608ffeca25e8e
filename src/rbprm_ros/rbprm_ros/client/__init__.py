"""A client of the planner for mission executives, and an example of an executive."""

from rbprm_ros.client.planner_client import PlanCall, PlannerClient, PlannerTimeout

__all__ = ["PlanCall", "PlannerClient", "PlannerTimeout"]
