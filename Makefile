# make setup | run | test | lint | bench | clean: needs Python 3.11 or newer, and nothing else.

PYTHON ?= python3
WORKERS ?= 2
BIN := .venv/bin
STAMP := .venv/.installed
PACKAGES := mapping coordination protocol server robot_agent sim_world
COVERAGE_MIN := 95
BOUNDS_CACHE := .venv/bounds-checked

.DEFAULT_GOAL := help
.PHONY: help setup run test lint coverage bounds tests bench docs clean

help:
	@echo "make setup   the project and its development tools in .venv"
	@echo "make run     three robots map the shipped hospital floor"
	@echo "make test    everything: style, types, import rule, coverage, bounds, all tests (minutes)"
	@echo "make lint    only style, types and the import rule (seconds)"
	@echo "make bench   times of the inner loops"
	@echo "make docs    write the generated pages anew"
	@echo "make clean   remove .venv, caches and compiled loops kept in the checkout"

setup: $(STAMP)

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "this project needs Python 3.11 or newer: make setup PYTHON=/path/to/python3.11" >&2; exit 2; }
	@test -x $(BIN)/pip || { rm -rf .venv; \
	  $(PYTHON) -m venv .venv >/dev/null 2>&1 || { rm -rf .venv; \
	  $(PYTHON) -m virtualenv .venv >/dev/null 2>&1; } || { rm -rf .venv; \
	  echo "cannot make .venv: run  sudo apt-get install python3-venv  and try again" >&2; exit 2; }; }
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	@touch $@

run: setup
	$(BIN)/expedition run auction --world hospital --robots 3

test: setup lint bounds coverage tests

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache --no-logo
	$(BIN)/mypy

# Compiled loops with every index checked; numba ignores the wish where compiled code is cached.
bounds: setup
	@rm -rf $(BOUNDS_CACHE)
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(CURDIR)/$(BOUNDS_CACHE) \
	  $(BIN)/pytest -n $(WORKERS) --dist loadfile -m "not slow" \
	  tests/unit/mapping tests/unit/coordination tests/unit/sim_world
	@rm -rf $(BOUNDS_CACHE)

# Branch coverage, measured on plain Python: the compiler's loops are invisible to it.
coverage: setup
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest -n $(WORKERS) --dist loadfile -m "not slow" \
	  --cov --cov-report= tests/unit tests/conformance
	@for package in $(PACKAGES); do \
	  $(BIN)/coverage report --skip-covered --skip-empty --include="$$package/*" \
	    --fail-under=$(COVERAGE_MIN) || failed="$$failed $$package"; \
	done; \
	test -z "$$failed" || { echo "branch coverage below $(COVERAGE_MIN) %:$$failed" >&2; exit 1; }

# Compiled once before the workers start, which would otherwise all do it at the same time.
tests: setup
	$(BIN)/python -c "from expedition.warm_up import warm_up; warm_up(print)"
	$(BIN)/pytest -n $(WORKERS) --dist loadgroup

bench: setup
	$(BIN)/python -m benchmarks.kernels

docs: setup
	$(BIN)/python -m docs.generate_settings
	$(BIN)/python -m docs.generate_messages

clean:
	rm -rf .venv .coverage .coverage.* htmlcov .pytest_cache .mypy_cache .ruff_cache .hypothesis \
	  .import_linter_cache *.egg-info build
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
