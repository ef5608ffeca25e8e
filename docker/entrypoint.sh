#!/bin/bash
# Run a command in the workspace's environment; executables of rbprm_ros are found by their names.
# RBPRM_ROBOT is the planner node's parameter `robot`; empty, it is what a parameter file says, or hyq.
set -e
[ ! -f /opt/ros/jazzy/setup.bash ] || . /opt/ros/jazzy/setup.bash
. "$RBPRM_WORKSPACE/setup.bash"
export PATH="$RBPRM_WORKSPACE/rbprm_ros/lib/rbprm_ros:$PATH"
case " $* " in
*" planner_node "*) [ -z "$RBPRM_ROBOT" ] || set -- "$@" --ros-args -p "robot:=$RBPRM_ROBOT" ;;
esac
exec "$@"
