"""The planner as a ROS 2 node; the planning itself is in rbprm_core, which knows no ROS."""
