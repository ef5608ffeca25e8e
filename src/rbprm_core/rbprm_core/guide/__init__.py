"""Guide planners (P1): a path of the root from start to goal."""
