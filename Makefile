# make run        the main job: evolve a biped, then draw its gait
# make test       the unit tests
# make test-slow  examples, other libraries, browser, wheel, the code in the documents
# make test-long  what takes minutes each: clusters, chains of kills, bits of every engine
# make test-all   all of them
# make docs       the documentation, into site/
# make lint       formatting, lint and types
# Each prepares .venv first, once. PYTHON=... chooses the interpreter, OUT=... the folder of the run.

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

# Side by side in as many processes as there are cores, at most four; a file's tests stay together.
PYTEST := $(BIN)/python -m pytest -n logical --maxprocesses 4 --dist loadfile

# The first of these that is a Python 3.11-3.13 with venv.
CANDIDATES := python3.11 python3.12 python3.13 python3 python
PYTHON ?= $(shell for p in $(CANDIDATES); do $$p -c \
	'import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' \
	2>/dev/null && echo $$p && break; done)

# runs/first, or the next free name.
OUT ?= $(shell n=1; out=runs/first; while [ -e $$out ]; do n=$$((n + 1)); out=runs/first-$$n; done; echo $$out)

.PHONY: run test test-slow test-long test-all docs lint

run: $(STAMP)
	$(BIN)/hebbtorch evolve --shape biped-4x3 --sensors low --terrain hilly-3-30 --duration 60 \
		--population 40 --generations 60 --out $(OUT)

test: $(STAMP)
	$(PYTEST) -m "not slow and not long"

test-slow: $(STAMP)
	$(PYTEST) -m slow

test-long: $(STAMP)
	$(BIN)/python -m pytest -m long

test-all: test test-slow test-long

docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

$(STAMP): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "No Python 3.11-3.13 found: install one, or name it with PYTHON=..."; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]' -c constraints.txt
	touch $@
