#!/bin/sh
# Check style and types.
set -eu
cd "$(dirname "$0")/.."

echo "ruff check"
.venv/bin/ruff check .
echo "ruff format --check"
.venv/bin/ruff format --check .
scripts/check_types.sh
