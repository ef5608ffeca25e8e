#!/bin/sh
# Types: the core strictly. rclpy and generated messages carry none, so that the ROS package may
# derive from and call untyped things.
set -eu
cd "$(dirname "$0")/.."

echo "mypy, strict: rbprm_core"
.venv/bin/mypy src/rbprm_core/rbprm_core
echo "mypy: rbprm_ros"
.venv/bin/mypy --ignore-missing-imports --allow-subclassing-any --allow-untyped-calls \
    --allow-untyped-decorators --no-warn-return-any src/rbprm_ros/rbprm_ros
