"""Views of a plan: a self-contained 3-D page and a picture, made from the plan record alone."""
