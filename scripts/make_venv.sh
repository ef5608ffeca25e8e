#!/bin/sh
# Steps 1 and 2 of set-up: check the prerequisites, make an empty .venv.
set -eu
cd "$(dirname "$0")/.."

echo "[1/5] checking prerequisites"
python=$(scripts/check_prerequisites.sh)

echo "[2/5] making .venv with $python ($("$python" -c 'import sys; print(sys.version.split()[0])'))"
rm -rf .venv ros2_ws/build ros2_ws/install ros2_ws/log # a build belongs to one interpreter
"$python" -m venv .venv
mkdir .venv/.stamps
"$python" -c 'import sys; print(sys.version)' >.venv/.stamps/venv
