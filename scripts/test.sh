#!/bin/bash
# All that a change has to pass; arguments go to pytest.
#
# Without arguments the tests of the ROS package, which mostly wait for other processes, run beside
# those of the core; their output follows.
set -eu -m  # with job control, what runs in the background may be interrupted, as tests do
cd "$(dirname "$0")/.."

scripts/lint.sh
if [ $# -gt 0 ]; then
    exec scripts/in_workspace.sh .venv/bin/python -m pytest "$@"
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
echo "pytest tests/ros, in the background"
scripts/in_workspace.sh .venv/bin/python -m pytest tests/ros >"$log" 2>&1 &
ros=$!
echo "pytest tests/core tests/bench"
status=0
scripts/in_workspace.sh .venv/bin/python -m pytest tests/core tests/bench || status=$?
wait "$ros" || status=$?
cat "$log"
exit "$status"
