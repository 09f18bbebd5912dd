# The two commands of the README are `make demo` and `make test`; each does the set-up it needs.
# `make help` lists the rest.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

PYTHON ?= python3
VENV := .venv
PY := $(VENV)/bin/python
CARGO ?= cargo
GRID ?= default
PDND := $(or $(CARGO_TARGET_DIR),target)/release/pdnd
# The peers and the real data that tests compare with; a test that misses them says so and skips.
export PDN_SHARED ?= $(abspath ../shared)
export PDND_BINARY ?= $(abspath $(PDND))

say = @printf '\n\033[1m== %s\033[0m\n' "$(1)"

.PHONY: help demo test torture bench setup build rust-lint rust-test python-lint python-test generate format clean

help: ## List the commands
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /\1\t/' | expand -t 16

demo: build $(VENV)/.ready ## Fly the paper's hull by every policy and leave figures and a table in demo/
	$(call say,Flying hull40: open loop and exhaustive revisit and PDN with five weights)
	$(PY) -m pdn.cli demo --daemon $(PDND) --out demo

test: ## Everything that a change must pass
	@$(MAKE) --no-print-directory rust-lint
	@$(MAKE) --no-print-directory rust-test
	@$(MAKE) --no-print-directory python-lint
	@$(MAKE) --no-print-directory python-test
	$(call say,All passed)

torture: build $(VENV)/.ready ## The long form of the tests of faults, some minutes to an hour
	PDN_TORTURE=1 $(CARGO) test --release --locked -p pdn-state --test crashes --test checkpoint -- --nocapture
	PDN_FUZZ_INPUTS=10000000 $(CARGO) test --release --locked -p pdn-schemas -p pdn-state --test malformed -- --nocapture
	cd tests && ../$(PY) -m pytest -q -rs -s -m torture

bench: $(VENV)/.ready ## Measure pdn beside GTSAM and CHOLMOD; GRID=quick or full, README=1 fills tests/perf/README.md
	$(CARGO) build --release --locked -p pdn-perf -p pdnd
	$(PY) tests/perf/bench.py --grid $(GRID) --binary $(dir $(PDND))pdn-perf $(if $(README),--readme)

setup: $(VENV)/.ready ## Make the Python environment in .venv

$(VENV)/.ready: client-py/pyproject.toml client-py/constraints.txt
	$(call say,Python environment in $(VENV))
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "pdn needs Python 3.11 or newer, but $(PYTHON) is $$($(PYTHON) --version); name another with: make PYTHON=python3.11 ..."; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || \
	  { echo "Python's venv module is missing; on Debian: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet --disable-pip-version-check -c client-py/constraints.txt -e 'client-py[test,oracles]'
	@touch $@

build: ## Build the daemon
	$(call say,Building the daemon (the first time takes some minutes))
	$(CARGO) build --release --locked -p pdnd

rust-lint:
	$(call say,Rust: format and lints)
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --locked --workspace --all-targets -- -D warnings

# Also builds target/release/pdnd; `make build` chose the same features, so nothing is built twice.
rust-test:
	$(call say,Rust: build and tests (the first time takes some minutes))
	$(CARGO) test --release --locked --workspace
	$(call say,The generated contract is what the types say)
	$(dir $(PDND))pdn-schemas generate --check

python-lint: $(VENV)/.ready
	$(call say,Python: format and lints and types)
	$(VENV)/bin/ruff format --check client-py tests
	$(VENV)/bin/ruff check client-py tests
	cd client-py && ../$(VENV)/bin/mypy

python-test: $(VENV)/.ready
	$(call say,Python and end-to-end tests)
	cd client-py && ../$(PY) -m pytest -q -rs tests
	cd tests && ../$(PY) -m pytest -q -rs

generate: ## Write what is generated from the Rust types: schemas/ and client-py's wire codec
	$(CARGO) run --release -q -p pdn-schemas -- generate

format: $(VENV)/.ready ## Format everything
	$(CARGO) fmt --all
	$(VENV)/bin/ruff format client-py tests
	$(VENV)/bin/ruff check --fix client-py tests

clean: ## Remove what was built
	rm -rf $(VENV) demo bench target
