#!/bin/sh
# All that a change has to pass; arguments go to pytest.
set -eu
cd "$(dirname "$0")/.."

scripts/lint.sh
echo "pytest"
exec scripts/in_workspace.sh .venv/bin/python -m pytest "$@"
