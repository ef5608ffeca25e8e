#!/bin/bash
# Run a command in the environment of the workspace; executables of rbprm_ros are found by their names.
# RBPRM_ROBOT sets the parameter `robot` of the planner node. If it is empty, the robot is that of a
# parameter file, or hyq.
set -e
[ ! -f /opt/ros/jazzy/setup.bash ] || . /opt/ros/jazzy/setup.bash
. "$RBPRM_WORKSPACE/setup.bash"
export PATH="$RBPRM_WORKSPACE/rbprm_ros/lib/rbprm_ros:$PATH"
case " $* " in
*" planner_node "*) [ -z "$RBPRM_ROBOT" ] || set -- "$@" --ros-args -p "robot:=$RBPRM_ROBOT" ;;
esac
exec "$@"
