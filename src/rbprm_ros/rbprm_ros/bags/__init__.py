"""Bags of the planner's topics: writing, reading, recording and playing."""
