#!/bin/sh
# Part of set-up: make .venv/peer, an environment without ROS, for tests of clients outside ROS.
set -eu
cd "$(dirname "$0")/.."
unset PYTHONPATH PYTHONHOME || true
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1

echo "      making .venv/peer, an environment without ROS"
rm -rf .venv/peer
.venv/bin/python -m venv --without-pip .venv/peer
.venv/bin/python -m pip --python .venv/peer/bin/python install --quiet --retries=10 --timeout=60 \
    --only-binary=:all: -c requirements/constraints.txt -r requirements/peer.txt
