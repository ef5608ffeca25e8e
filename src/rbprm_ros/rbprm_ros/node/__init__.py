"""The planner's ROS node: services, action, publishers and parameters."""
