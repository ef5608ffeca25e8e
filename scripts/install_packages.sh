#!/bin/sh
# Steps 3 and 4 of set-up: install the pinned packages, adapt the ROS wheels to this .venv.
set -eu
cd "$(dirname "$0")/.."
unset PYTHONPATH PYTHONHOME AMENT_PREFIX_PATH CMAKE_PREFIX_PATH || true
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1

.venv/bin/python scripts/install_packages.py
echo "[4/5] adapting the ROS wheels to this .venv"
.venv/bin/python scripts/adapt_ros_wheels.py
