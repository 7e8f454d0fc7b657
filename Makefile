# make demo: set up and drive. make test: everything. See README.md.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
# without what it asks for: opencv-python brings the same cv2 as our opencv-python-headless, and its metrics use neither
TRACKEVAL := 'trackeval>=1.3,<2'
SOURCES := proto domain drivemcp services app evaluation training studies benchmarks examples tests scripts
PROJECTS := pyproject.toml evaluation/pyproject.toml
ARGS   ?=
# files of safety properties; a family is a property in all its ways (tests/safety.py)
SAFETY := tests/unit/services/orchestrator/test_safety.py tests/unit/services/orchestrator/test_who_is_ahead.py \
	tests/unit/services/arbiter/test_properties.py
SAFETY_EXAMPLES ?= 20000
# files that each reader of foreign files is tried on; these take about an hour on two cores
FUZZ_EXAMPLES ?= 75000
# tests on as many cores as there are, four at most; ARGS='-n 0' runs them one after another
SIDE_BY_SIDE := -n logical --maxprocesses 4 --dist worksteal

.DEFAULT_GOAL := help
.PHONY: help demo install check format test replay properties fuzz stack conformance chaos soak mutation bench mcpb evaluate docs release clean

help:
	@echo "make demo     set up what a drive needs, then drive urb-rain for 60 s (ARGS='--headless ...')"
	@echo "make install  the full environment, all extras, in $(VENV)"
	@echo "make check    format, lint, types, layers, generated pages, language"
	@echo "make test     all tests but those that make stack runs"
	@echo "make replay   what the stack decides and sees beside the behaviour lock (ARGS=--update locks anew)"
	@echo "make properties  the families of safety properties, 20,000 examples each"
	@echo "make fuzz     every reader of foreign files on disturbed files, about an hour (FUZZ_EXAMPLES=3000 for less)"
	@echo "make stack    whole processes and containers (needs a Docker engine for the latter), make chaos, make properties, make fuzz"
	@echo "make conformance  the official conformance suite of MCP against the gateway (needs npm)"
	@echo "make chaos    drives whose processes, network, disk, memory, files and clock fail (CHAOS_SEED=1)"
	@echo "make soak     memory of each process over a drive of 30 minutes (ARGS='--minutes 15')"
	@echo "make mutation what no test of the arbiter tells from a changed arbiter, all mutants (ARGS='--sample 30 --seed 7')"
	@echo "make bench    ours beside what one would pick instead, in one run"
	@echo "make mcpb     a bundle that a desktop client installs, and server.json (ARGS='--url URL')"
	@echo "make docs     the pages as a site with search, in build/site; a broken link ends it"
	@echo "make release  wheel and sdist, tried on each Python here, SBOMs, images, notes, checksums in dist/ (ARGS=--rehearse)"
	@echo "make evaluate the paper's tables, measured (ARGS='results --quick'; without: all of them, for hours)"

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit("DriveMCP needs Python 3.11 or newer; this is %d.%d: make PYTHON=python3.11" % sys.version_info[:2] if sys.version_info < (3, 11) else 0)'
	@$(PYTHON) -c 'import sys, sysconfig; built = str(sysconfig.get_config_var("CONFIG_ARGS")); sys.base_prefix == "/usr" or "--enable-optimizations" in built or print("note: this Python was built without --enable-optimizations, so drives without pictures take a fifth more time (docs/how-to/operations.md)")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install -q --upgrade pip
	@touch $@

$(VENV)/.demo: $(VENV)/.made $(PROJECTS)
	@echo "installing what a drive needs (a few minutes; no torch)"
	$(BIN)/pip install --progress-bar on -e '.[demo]' | grep -v '^Requirement already satisfied' || true
	$(BIN)/pip install -q --no-deps -e ./evaluation
	@$(BIN)/python -c 'import zenoh, msgspec, cv2, onnxruntime, highway_env, moderngl, mcap, rerun' \
		|| { echo "the installation did not finish; see pip's last lines above and run make again" >&2; exit 1; }
	@touch $@

$(VENV)/.full: $(VENV)/.made $(PROJECTS)
	@echo "installing the full environment (several minutes)"
	$(BIN)/pip install --progress-bar on -e '.[demo,dev,train,retrieval-torch,retrieval-qdrant,ray]' -e ./evaluation | grep -v '^Requirement already satisfied' || true
	$(BIN)/pip install -q --no-deps $(TRACKEVAL)
	@$(BIN)/python -c 'import zenoh, cv2, onnxruntime, highway_env, hypothesis, pytest, mypy, torch, trackeval' \
		|| { echo "the installation did not finish; see pip's last lines above and run make again" >&2; exit 1; }
	@touch $(VENV)/.demo $@

demo: $(VENV)/.demo
	@scripts/system-packages $(BIN)/python
	@$(BIN)/drivemcp up --scenario urb-rain --seconds 60 --report $(ARGS)

install: $(VENV)/.full
	@scripts/system-packages $(BIN)/python

check: $(VENV)/.full
	$(BIN)/ruff format --check $(SOURCES)
	$(BIN)/ruff check $(SOURCES)
	$(BIN)/mypy $(SOURCES)
	$(BIN)/lint-imports
	$(BIN)/python -m scripts.reference --check
	$(BIN)/python -m scripts.prose

format: $(VENV)/.full
	$(BIN)/ruff format $(SOURCES)
	$(BIN)/ruff check --fix $(SOURCES)

test: $(VENV)/.full
	@scripts/system-packages $(BIN)/python
	$(BIN)/pytest -m 'not stack' $(SIDE_BY_SIDE) $(ARGS)

replay: $(VENV)/.full
	@scripts/system-packages $(BIN)/python
	$(BIN)/python -m tests.replay $(ARGS)

stack: $(VENV)/.full
	@scripts/system-packages $(BIN)/python
	$(BIN)/pytest -m stack $(ARGS)
	SAFETY_EXAMPLES=$(SAFETY_EXAMPLES) $(BIN)/pytest $(SIDE_BY_SIDE) $(SAFETY)
	FUZZ_EXAMPLES=$(FUZZ_EXAMPLES) $(BIN)/pytest $(SIDE_BY_SIDE) tests/fuzz

# pinned by its lock; without npm the test is skipped, and says so
.conformance/.made: tests/conformance/package.json tests/conformance/package-lock.json
	@mkdir -p .conformance && cp $^ .conformance/
	@npm --prefix .conformance ci --silent --no-audit --no-fund && touch $@ \
		|| echo "npm is not there, or cannot fetch the suite: the conformance of MCP is not tested" >&2

conformance: $(VENV)/.full .conformance/.made
	$(BIN)/pytest tests/conformance $(ARGS)

chaos: $(VENV)/.full
	@scripts/system-packages $(BIN)/python
	$(BIN)/pytest -m stack tests/stack/test_chaos.py $(ARGS)

soak: $(VENV)/.full
	@scripts/system-packages $(BIN)/python
	$(BIN)/python -m studies soak $(ARGS)

properties: $(VENV)/.full
	SAFETY_EXAMPLES=$(SAFETY_EXAMPLES) $(BIN)/pytest $(SIDE_BY_SIDE) $(SAFETY) $(ARGS)

fuzz: $(VENV)/.full
	FUZZ_EXAMPLES=$(FUZZ_EXAMPLES) $(BIN)/pytest $(SIDE_BY_SIDE) tests/fuzz $(ARGS)

mutation: $(VENV)/.full
	CI=1 PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python scripts/mutation.py $(ARGS)

bench: $(VENV)/.full
	@scripts/system-packages $(BIN)/python
	$(BIN)/python -m benchmarks $(ARGS)

mcpb: $(VENV)/.made
	$(BIN)/python scripts/mcp_bundle.py $(ARGS)

evaluate: $(VENV)/.full
	@scripts/system-packages $(BIN)/python
	$(BIN)/drivemcp evaluate $(or $(ARGS),all)

docs: $(VENV)/.full
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict $(ARGS)
	@echo "to read it: $(BIN)/python -m http.server --directory build/site"

release: $(VENV)/.demo
	@scripts/system-packages $(BIN)/python
	$(BIN)/python -m scripts.release $(ARGS)

clean:
	rm -rf $(VENV) .venv-peers .venv-langgraph build dist out .mypy_cache .ruff_cache .hypothesis mutants
