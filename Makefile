# What a newcomer needs: `make demo`, `make test`. Details of each step are in scripts/.
#
# Everything made lands in .venv and ros2_ws/{build,install,log}. Stamp files tell what is up to date;
# each bears the time at which its step began, so that an edit made meanwhile is not missed.

VENV  := .venv
STAMP := $(VENV)/.stamps
BUILT := ros2_ws/install/.built

# The interpreter .venv is made with: `make setup PYTHON=python3.12`. Without it an existing .venv
# stays as it is, and a new one takes the first suitable python3 on the PATH.
PYTHON ?=
export PYTHON

REQUIREMENTS := $(wildcard requirements/*.txt) $(wildcard src/rbprm_core/setup.py src/rbprm_core/pyproject.toml)
INTERFACES   := $(shell find msg_defs -name '*~' -prune -o -print)
PACKAGING    := $(wildcard src/*/package.xml src/*/pyproject.toml src/*/setup.py src/*/setup.cfg src/rbprm_ros/launch/* src/rbprm_ros/config/*)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help setup demo test lint docs clean FORCE

help: ## List these targets
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' Makefile | awk -F '\t' '{printf "  make %-7s %s\n", $$1, $$2}'
	@echo
	@echo "  PYTHON=python3.12 selects the interpreter (3.11 or 3.12)."

setup: $(BUILT) ## Install everything into .venv and build ros2_ws

demo: setup ## Plan HyQ across the rubble through the ROS 2 node; leaves plan and pictures in demo_output
	@scripts/demo.sh

test: setup $(STAMP)/peer ## Style, types and all tests
	@scripts/test.sh

lint: $(STAMP)/packages ## Style and types only
	@scripts/lint.sh

docs: $(STAMP)/docs ## The documentation as pages, docs/_build/html/index.html
	@.venv/bin/python -m sphinx --fail-on-warning --keep-going --quiet docs docs/_build/html
	@echo "docs/_build/html/index.html"

clean: ## Remove everything that was made, .venv included
	rm -rf $(VENV) ros2_ws/build ros2_ws/install ros2_ws/log demo_output bench_output
	rm -rf docs/_build docs/api
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis src/*/*.egg-info src/*/build
	find src tests scripts examples -name __pycache__ -type d -prune -exec rm -rf {} +

# A PYTHON that is not the one of .venv makes a new .venv.
ifneq ($(PYTHON),)
ifneq ($(shell $(PYTHON) -c 'import sys; print(sys.version)' 2>&1),$(shell cat $(STAMP)/venv 2>/dev/null))
$(STAMP)/venv: FORCE
endif
endif

$(STAMP)/venv:
	@scripts/make_venv.sh

$(STAMP)/packages: $(STAMP)/venv $(REQUIREMENTS) scripts/install_packages.py scripts/adapt_ros_wheels.py
	@touch $@.begun
	@scripts/install_packages.sh
	@mv $@.begun $@

# Apart from `setup`: only tests need it.
$(STAMP)/peer: $(STAMP)/packages requirements/peer.txt scripts/make_peer_venv.sh
	@touch $@.begun
	@scripts/make_peer_venv.sh
	@mv $@.begun $@

# Apart from `setup`: only the documentation needs it.
$(STAMP)/docs: $(STAMP)/packages requirements/docs.txt requirements/constraints.txt
	@touch $@.begun
	@.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-input --retries=10 \
		--timeout=60 --only-binary=:all: -c requirements/constraints.txt -r requirements/docs.txt
	@mv $@.begun $@

$(BUILT): $(STAMP)/packages $(INTERFACES) $(PACKAGING) scripts/build_workspace.sh
	@mkdir -p $(@D) && touch $@.begun
	@scripts/build_workspace.sh
	@mv $@.begun $@
