#!/bin/bash
# All that a change has to pass; arguments go to pytest.
#
# Without arguments the tests of the ROS package, which mostly wait for other processes, run beside
# those of the core; their output follows. The tests of the core measure its coverage: what runs in
# their own process, not in the programs that they start. tests/bench measures times, without it.
set -eu -m  # with job control, what runs in the background may be interrupted, as tests do
cd "$(dirname "$0")/.."

scripts/lint.sh
if [ $# -gt 0 ]; then
    exec scripts/in_workspace.sh .venv/bin/python -m pytest "$@"
fi

log=$(mktemp)
coverage=$(mktemp)
trap 'rm -f "$log" "$coverage"' EXIT
echo "pytest tests/ros, in the background"
scripts/in_workspace.sh .venv/bin/python -m pytest tests/ros >"$log" 2>&1 &
ros=$!
status=0
echo "pytest tests/core"
scripts/in_workspace.sh .venv/bin/python -m slipcover --json --out "$coverage" \
    --source src/rbprm_core/rbprm_core \
    -m pytest -W ignore::pytest.PytestAssertRewriteWarning tests/core || status=$?
.venv/bin/python scripts/print_coverage.py "$coverage" || status=$?
echo "pytest tests/bench"
scripts/in_workspace.sh .venv/bin/python -m pytest tests/bench || status=$?
wait "$ros" || status=$?
cat "$log"
exit "$status"
