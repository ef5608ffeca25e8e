#!/bin/bash
# Run the demo after set-up; arguments are passed to examples/demo.py.
set -eu
cd "$(dirname "$0")/.."

# A domain of its own: a robot that this shell is set up for must not receive the demo's messages.
export ROS_DOMAIN_ID=$((1 + $$ % 100)) ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
exec scripts/in_workspace.sh .venv/bin/python examples/demo.py "$@"
