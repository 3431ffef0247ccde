# Every target sets up what it needs in a virtual environment. Another Python: make PYTHON=python3.12 test
PYTHON ?= python3
VENV ?= .venv

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
.PHONY: help demo test test-live lint format bench studies docs constraints clean

BIN := $(VENV)/bin
RUNTIME := $(VENV)/.installed-runtime
DEV := $(VENV)/.installed-dev
LIVE := $(VENV)/.installed-live

# $(call install,PYTHON,ARGUMENTS): pip, told as the names of the packages as they come; all it says when it fails
install = $(1) -m pip install $(2) 2> $(1)-pip.log \
  | awk '/^Collecting/ {sub(/[^A-Za-z0-9_.-].*/, "", $$2); printf " %s", $$2; fflush()} END {print ""}' \
  || { cat $(1)-pip.log >&2; exit 1; }

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-12s %s\n", $$1, $$2}' Makefile

demo: $(RUNTIME) ## monitor a simulated arm that gets stuck, is helped, and then does it alone
	@$(BIN)/tactful demo

test: $(DEV) ## run the tests
	@$(BIN)/python -m pytest -q -n 2 --dist loadfile

test-live: $(LIVE) ## run the tests against the clients of real robots (Linux, Python up to 3.12)
	@$(BIN)/python -m pytest -q -m live tests/live

lint: $(DEV) ## check style, types and the direction of imports
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

format: $(DEV) ## mend what the linter can mend
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

bench: $(DEV) ## measure speed against the stated bounds
	@$(BIN)/python -m benchmarks

studies: $(DEV) ## run the experiments in simulation into build/studies (tens of minutes on two cores)
	@$(BIN)/tactful study isolation --out build/studies/isolation
	@$(BIN)/tactful study kinesthetic --out build/studies/kinesthetic
	@$(BIN)/tactful study teaching --out build/studies/teaching
	@$(BIN)/tactful study reactions --out build/studies/reactions
	@$(BIN)/tactful study aim-aware --out build/studies/aim-aware
	@$(BIN)/tactful study aim-aware --robot panda --out build/studies/aim-aware
	@$(BIN)/tactful study impact-causes --out build/studies/impact-causes

docs: export NO_MKDOCS_2_WARNING := 1
docs: $(DEV) ## build the site in build/site
	@$(BIN)/mkdocs build --strict --quiet
	@echo "docs: build/site/index.html"

constraints: ## resolve all extras anew and pin them (run it with the oldest supported Python)
	@rm -rf build/constraints && $(PYTHON) -m venv build/constraints
	@printf "resolving:"; $(call install,build/constraints/bin/python,-e ".[dev,live-test]")
	@build/constraints/bin/python -m pip freeze --exclude tactful --exclude-editable > constraints.txt
	@echo "constraints.txt: $$(wc -l < constraints.txt) pins"

clean: ## remove the environment and everything built
	rm -rf $(VENV) build dist .hypothesis .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "Tactful needs Python 3.11 or newer; $(PYTHON) is: $$($(PYTHON) --version 2>&1 | head -n 1). Try: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV)

$(RUNTIME): pyproject.toml constraints.txt | $(BIN)/python
	@printf "installing into $(VENV):"; $(call install,$(BIN)/python,-c constraints.txt -e ".[all]")
	@$(BIN)/python -m pip install -q -c constraints.txt -e ".[teach]" 2> $(BIN)/python-pip.log \
	  || echo "without what needs a C compiler (movement_primitives), the demo ends before the lesson is applied" >&2
	@touch $@

$(DEV): pyproject.toml constraints.txt | $(BIN)/python
	@printf "installing into $(VENV):"; $(call install,$(BIN)/python,-c constraints.txt -e ".[dev]")
	@touch $(RUNTIME) $@

$(LIVE): $(DEV)
	@printf "installing into $(VENV):"; $(call install,$(BIN)/python,-c constraints.txt -e ".[live-test]")
	@touch $@
