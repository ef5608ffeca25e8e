"""Serving plans, monitoring the published sequence, and the planner's status."""
