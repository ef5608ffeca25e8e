"""Guide planners (P1): a path of the robot's root from start to goal.

`protocol` defines the interface of the stage, `registry` the planners by name. The other modules
here serve any planner of root paths; `root` holds those of this package.
"""
