# Every target shares one idempotent set-up step: a virtual environment in .venv with the locked packages.
SHELL := /bin/bash
VENV := .venv
PY := $(VENV)/bin/python
STAMP := $(VENV)/.ready
LEAN := $(VENV)/.lean
LEAN_LOCK := config/system/requirements.lock
PYTHON ?= python3
PYTEST_ARGS ?=
# What pytest makes of the tests' sources is kept for the second half, also where Python is told to keep nothing.
PYTEST := PYTHONDONTWRITEBYTECODE= $(PY) -m pytest --dist loadgroup --no-loadscope-reorder
NONE_CHOSEN := 5
# On a machine that is busy already six tests on the real clock starve each other: two at a time then, and before what it is busy with.
# Not where it is idle: the kernel's own workers, which carry what a pseudo-terminal is written, would come after them.
IS_BUSY := awk '{ exit !($$1 > 5) }' /proc/loadavg 2>/dev/null
REAL_CLOCK := tests/e2e tests/firmware/test_pty_real_time.py tests/firmware/test_pty_deadlines.py

.PHONY: help setup lean lean-compiled wheel compiled pypy sim test check bench bench-compare soak fuzz docs lock clean

help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

lean: $(LEAN) ## set up .venv with what sailing, simulating and reporting need (140 MB)

$(LEAN): $(LEAN_LOCK) pyproject.toml
	@PYTHON="$(PYTHON)" tools/setup.sh $(VENV) $(LEAN_LOCK) .lean

setup: $(STAMP) ## set up .venv with everything that developers need too (930 MB)

$(STAMP): requirements.lock pyproject.toml
	@PYTHON="$(PYTHON)" tools/setup.sh $(VENV)

compiled: $(STAMP) lean-compiled

wheel: $(LEAN) ## build the wheel that is installed on a boat -> build/ (docs/RASPBERRY.md)
	@rm -rf build/lib build/bdist.*; $(PY) -m pip wheel --disable-pip-version-check -q --no-deps --no-build-isolation -w build . && ls build/usv_companion-*.whl

lean-compiled: $(LEAN)  # as pip does with a wheel; Python may be told not to do it by itself, and then parses all sources at each start
	@-$(PY) -m compileall -q companion mavlink_bridge sitl config

pypy: .venv-pypy/.ready ## set up .venv-pypy: long simulations and replays at two to three times the speed (docs/RECORDINGS.md)

.venv-pypy/.ready: requirements-pypy.lock pyproject.toml
	@python="$$(PYPY="$(PYPY)" tools/find_pypy.sh)" && PYTHON="$$python" tools/setup.sh .venv-pypy requirements-pypy.lock

sim: lean-compiled ## run the simulated vessel with all its links
	@$(VENV)/bin/companion sim $(SIM_ARGS)

test: compiled ## the whole test suite (what CI runs); what fails in the first half hides nothing of the second
	@failed=0; run() { "$$@" || [ $$? -eq $(NONE_CHOSEN) ] || failed=1; }; \
	echo "tests in virtual time ..."; \
	run env $(PYTEST) -n 2 -m "not soak and not e2e" $(PYTEST_ARGS); \
	echo "tests on the real clock, with the machine to themselves ..."; \
	workers=6; preferred=; if $(IS_BUSY); then workers=2; preferred=tools/preferred.sh; fi; \
	run $$preferred env $(PYTEST) -n $$workers -m "e2e and not soak" $(REAL_CLOCK) $(PYTEST_ARGS); \
	exit $$failed

check: $(STAMP) ## format, lint, types, import rules
	@echo "format ..."  && $(VENV)/bin/ruff format --check .
	@echo "lint ..."    && $(VENV)/bin/ruff check .
	@echo "types ..."   && $(VENV)/bin/mypy
	@echo "imports ..." && $(VENV)/bin/lint-imports --no-cache

bench: compiled ## the benchmark suite -> build/bench.json and build/bench.md
	@$(PY) -m tools.bench $(BENCH_ARGS)

bench-compare: $(STAMP) ## compare two benchmark files: make bench-compare OLD=a.json NEW=b.json
	@$(PY) -m tools.bench_compare $(OLD) $(NEW)

soak: compiled ## the long runs
	@$(PY) -m pytest -m soak $(PYTEST_ARGS)

fuzz: $(STAMP) ## structure-aware, then coverage-guided fuzzing of every byte that a stranger can send
	@$(PY) -m tools.fuzz $(FUZZ_ARGS)
	@$(PY) -m tools.fuzz_guided $(FUZZ_GUIDED_ARGS)

docs: $(STAMP) ## write the generated pages of docs/ again
	@$(PY) -m tools.generate_docs

lock: ## pin every dependency again (needs uv)
	uv pip compile pyproject.toml --all-extras --overrides requirements-overrides.txt --generate-hashes --universal --no-emit-index-url --no-header --python-version 3.11 -o requirements.lock
	uv pip compile pyproject.toml requirements-lean.in --extra status --extra ground --constraint requirements.lock --generate-hashes --universal --no-emit-index-url --no-header --python-version 3.11 -o config/system/requirements.lock
	uv pip compile pyproject.toml requirements-pypy.in --extra status --generate-hashes --universal --no-emit-index-url --no-header --python-version 3.11 -o requirements-pypy.lock

clean: ## remove what was built
	rm -rf $(VENV) .venv-pypy .pypy build .pytest_cache .mypy_cache .ruff_cache *.egg-info
