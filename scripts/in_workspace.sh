#!/bin/bash
# Run a command in the environment of the built workspace, isolated from other ROS nodes:
#   scripts/in_workspace.sh COMMAND [ARGUMENT]...
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/ros2_ws/install/setup.bash"
export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
export ROS_DOMAIN_ID=${ROS_DOMAIN_ID:-$((1 + $$ % 100))}
export ROS_LOG_DIR=${ROS_LOG_DIR:-$root/ros2_ws/log/ros}
exec "$@"
