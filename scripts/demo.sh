#!/bin/bash
# The main job for real, after set-up: arguments go to examples/demo.py.
set -eu
cd "$(dirname "$0")/.."

# Apart from any robot that this shell is set up for.
export ROS_DOMAIN_ID=$((1 + $$ % 100)) ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
exec scripts/in_workspace.sh .venv/bin/python examples/demo.py "$@"
