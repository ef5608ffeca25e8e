"""Plans for the eye: a self-contained 3-D page and a picture. Knows the plan, not the planner."""
