#!/bin/sh
# Step 5 of set-up: colcon builds ros2_ws on top of .venv.
set -eu
cd "$(dirname "$0")/.."
scripts/check_prerequisites.sh >/dev/null
# A ROS installation that the shell has sourced must not influence the build.
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH || true
. .venv/local_setup.sh

echo "[5/5] building ros2_ws (most of a minute, for the messages)"
start=$(date +%s)
cd ros2_ws
colcon build --symlink-install \
    --cmake-args -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF \
    "-DPython3_EXECUTABLE=$(command -v python)"
echo "      done in $(($(date +%s) - start)) s; to use it: . ros2_ws/install/setup.bash"
