# Two commands do it all: `make demo` and `make test`. Each installs everything into .venv first.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.DEFAULT_GOAL := help

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# A sourced ROS 2 brings its own rclpy, compiled against numpy 1; else rclpy comes as wheels.
ifdef ROS_DISTRO
RCLPY := installed
LOCK := requirements-installed-ros.lock
VENV_OPTIONS := --system-site-packages
else
RCLPY := wheels
LOCK := requirements.lock
VENV_OPTIONS :=
endif

PYTHON_VERSION := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)
INSTALLED := $(VENV)/.installed-$(RCLPY)-python$(PYTHON_VERSION)
PIP_INSTALL := $(BIN)/python -m pip install --quiet --use-pep517 --disable-pip-version-check

# A sourced ROS 2 puts pytest plugins of its own on the path: load only ours. One thread of BLAS, as fjr has.
PYTEST := OMP_NUM_THREADS=1 PYTEST_DISABLE_PLUGIN_AUTOLOAD=1 $(BIN)/python -m pytest -p xdist.plugin -p _hypothesis_pytestplugin

COLCON := $(abspath $(BIN))/colcon --log-base log

# What tells soon whether a change broke something: no nodes, no diagnosis from bags to report.
QUICK := $(addprefix tests/,docs controller_node excitation_node fjr_records fjr_sim_node/test_plant.py \
  fjr_sim_node/test_effects_of_drive_and_gear.py gap_diagnosis/test_evidence.py gap_diagnosis/test_record_loop.py)

.PHONY: help demo test test-quick ws bench docs lint lock clean check-machine

help: ## show the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 12
	echo 'Another Python: make demo PYTHON=python3.12'

demo: $(INSTALLED) ## install everything, run a campaign on the ROS graph, write its report
	@$(BIN)/fjr demo

# Four workers keep two cores busy: the one that plays graphs waits half of its time, others a little.
test: $(INSTALLED) ## install everything, run the tests: 15 to 30 minutes on two cores
	@echo "All tests: 15 to 30 minutes on two cores. make test-quick takes one or two."
	$(PYTEST) -n 4 --dist loadfile --no-loadscope-reorder

test-quick: $(INSTALLED) ## run the tests of the cores that take least: one or two minutes
	@$(PYTEST) -n 2 --dist loadfile -m 'not ros and not slow' $(QUICK)

ws: $(INSTALLED) ## build the ROS packages in ros_ws with colcon, test what was installed
	@cd ros_ws
	export PYTEST_DISABLE_PLUGIN_AUTOLOAD=1
	$(COLCON) build
	$(COLCON) test --return-code-on-test-failure || status=$$?
	$(COLCON) test-result --verbose
	exit $${status-0}

bench: $(INSTALLED) ## measure the figures of benchmarks/ on this machine
	@$(BIN)/python -m benchmarks

docs: $(INSTALLED) ## build the documentation site; a broken link or reference fails
	@NO_MKDOCS_2_WARNING=1 PYTHONPATH=. $(BIN)/python -m mkdocs build --strict --quiet
	echo build/site/index.html

lint: $(INSTALLED) ## check style and types
	@$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

lock: ## compile both lock files anew (needs uv)
	@extras=(--extra={report,dask,dev,docs,bench,export,rivals,hdf5})
	compile() { uv pip compile --quiet --universal --no-strip-extras --generate-hashes --custom-compile-command 'make lock' pyproject.toml - "$${extras[@]}" "$$@"; }
	echo 'setuptools>=77' | compile --python-version 3.10 --extra ros --output-file requirements.lock
	printf '%s\n' 'setuptools>=77' 'numpy<2' | compile --python-version 3.12 --output-file requirements-installed-ros.lock
	! grep -nE '://|^--' requirements.lock requirements-installed-ros.lock

clean: ## remove .venv and everything that tools left behind
	@rm -rf $(VENV) build *.egg-info ros_ws/{build,install,log} .pytest_cache .hypothesis .mypy_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Everything that can stand in the way, each in one sentence.
check-machine:
	@fail() { echo "$$1" >&2; exit 1; }
	[ -n "$(PYTHON_VERSION)" ] || fail "There is no Python '$(PYTHON)': name one of 3.10 to 3.13, such as make demo PYTHON=python3.12."
	case "$(PYTHON_VERSION)" in
	  3.10|3.11|3.12|3.13) ;;
	  *) fail "'$(PYTHON)' is Python $(PYTHON_VERSION), but 3.10 to 3.13 is needed: name another, such as make demo PYTHON=python3.12." ;;
	esac
	$(PYTHON) -c 'import sys; sys.exit(sys.platform != "linux" or sys.maxsize < 2**32)' \
	  || fail "This machine is not a 64-bit Linux, which ROS 2 and its wheels need."
	$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null \
	  || fail "'$(PYTHON)' cannot make virtual environments: install its venv module (Debian, Ubuntu: sudo apt install python$(PYTHON_VERSION)-venv)."
	if [ -n "$${ROS_DISTRO-}" ]; then
	  [ "$$ROS_DISTRO" = jazzy ] || fail "ROS 2 '$$ROS_DISTRO' is sourced here, but Jazzy is needed: use a shell in which no ROS is sourced, or source Jazzy."
	  $(PYTHON) -c 'import rclpy' 2>/dev/null || fail "ROS 2 Jazzy is sourced, but '$(PYTHON)' (Python $(PYTHON_VERSION)) cannot import its rclpy: take the Python it was built for (PYTHON=/usr/bin/python3), or a shell in which no ROS is sourced."
	elif [ "$$(uname -m)" != x86_64 ]; then
	  fail "The wheels of rclpy exist for x86-64 only and this is $$(uname -m): install ROS 2 Jazzy, source its setup.bash and try again."
	fi

$(INSTALLED): pyproject.toml $(LOCK) | check-machine
	@echo "Installing into $(VENV) (Python $(PYTHON_VERSION), rclpy: $(RCLPY)) ..."
	if [ ! -e $@ ]; then rm -rf $(VENV); $(PYTHON) -m venv $(VENV_OPTIONS) $(VENV); fi
	$(PIP_INSTALL) --require-hashes --requirement $(LOCK)
	$(PIP_INSTALL) --no-deps --no-build-isolation --editable .
	touch $@
