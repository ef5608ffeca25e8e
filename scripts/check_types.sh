#!/bin/sh
# Type check. The core is checked strictly. rclpy and generated messages have no types, so the ROS
# package may derive from untyped classes and call untyped functions.
set -eu
cd "$(dirname "$0")/.."

echo "mypy, strict: rbprm_core"
.venv/bin/mypy src/rbprm_core/rbprm_core
echo "mypy: rbprm_ros"
.venv/bin/mypy --ignore-missing-imports --allow-subclassing-any --allow-untyped-calls \
    --allow-untyped-decorators --no-warn-return-any src/rbprm_ros/rbprm_ros
