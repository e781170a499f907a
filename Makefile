# The recipes a developer runs are the recipes CI runs. `make` alone lists them.
.DEFAULT_GOAL := help
.PHONY: help setup demo browser test test-rust test-python lint format dist docs bench bench-accuracy experiments clean
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:

VENV := .venv
BIN := $(VENV)/bin
# the first interpreter that is new enough; PYTHON=... chooses another
PYTHON ?= $(shell for python in python3 python3.14 python3.13 python3.12 python3.11; do \
	if $$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then echo $$python; break; fi; done)
# PyO3 asks this interpreter what to build for, so that lint and build share their results
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
# an activated environment of the caller's is not ours to install into; maturin's own pip is as quiet as ours
unexport CONDA_PREFIX
export PIP_QUIET := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1

RUST_SOURCES := Cargo.toml $(wildcard Cargo.lock) $(shell find crates -name '*.rs' -o -name Cargo.toml)
PYTHON_SOURCES := python tests $(wildcard experiments docs benches)

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-16s%s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(BIN)/.built ## a virtual environment in .venv with the compiled package in it; the second time there is nothing to do

# Two stamps: new dependencies install everything, a change in Rust only compiles.
$(BIN)/.installed: pyproject.toml
	@[ -n "$(PYTHON)" ] || { echo "make setup: Python 3.11 or later is needed; PYTHON=/path/to/python chooses one" >&2; exit 1; }
	@command -v cargo >/dev/null || { echo "make setup: cargo is needed: install a Rust toolchain (1.87 or later)" >&2; exit 1; }
	$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv $(VENV) # also where an earlier try found no ensurepip
	$(BIN)/python -m pip install --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --group dev
	@touch $@

ifeq ($(wildcard python/asbuilt/_core*.so),)
.PHONY: $(BIN)/.built # the stamp is there but what it stands for is gone
endif
$(BIN)/.built: $(BIN)/.installed $(RUST_SOURCES)
	VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/maturin develop --release --quiet
	@touch $@

demo: setup ## the main job on the bundled example; results in out/demo
	@mkdir -p out/demo
	$(BIN)/asbuilt plan examples/small_house/scans.laz \
		-o out/demo/plan.geojson -o out/demo/plan.dxf -o out/demo/plan.pdf -o out/demo/plan.svg -o out/demo/plan.png \
		-o out/demo/plan.ifc -o out/demo/plan.html

browser: ## Chromium and its driver, which the report's tests open it in and skip without (Debian, as root)
	{ command -v chromium && command -v chromedriver; } >/dev/null || { apt-get update -qq && \
		DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends chromium chromium-driver; }

test: test-rust test-python ## all tests, Rust and Python

test-rust: setup
	cargo test --release --quiet -p asbuilt-core

test-python: setup
	$(BIN)/python -m pytest

lint: setup ## formatting, clippy, ruff, mypy, stubtest
	cargo fmt --all --check
	cargo clippy --release --quiet --workspace --all-targets -- -D warnings
	$(BIN)/ruff format --check $(PYTHON_SOURCES)
	$(BIN)/ruff check $(PYTHON_SOURCES)
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest asbuilt._core

format: setup ## format Rust and Python, and mend what ruff can mend
	cargo fmt --all
	$(BIN)/ruff check --fix --exit-zero $(PYTHON_SOURCES)
	$(BIN)/ruff format $(PYTHON_SOURCES)

dist: setup ## the wheel and the source archive, into dist
	$(BIN)/maturin build --release --sdist --out dist --quiet

docs: setup ## the documentation, into out/docs; a warning fails
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet -b html docs out/docs
	@echo "out/docs/index.html"

POINTS ?= 50000000
BUILDING ?= examples/small_house/scans.laz
bench: setup ## speed against peers and what plans cost, into docs/benchmarks.md (an hour and 12 GB in out/bench; POINTS=5000000 for less, BUILDING=... to plan)
	$(BIN)/python -m pip install --group bench
	cargo build --release --quiet -p asbuilt-core --example peers
	$(BIN)/python benches/run.py out/bench/$(POINTS) --points $(POINTS)
	$(BIN)/python benches/plan.py $(BUILDING)

ACCURACY ?= --worse
bench-accuracy: setup ## the accuracy tables (an hour; with ACCURACY= a few minutes, without worsened clouds)
	$(BIN)/python experiments/accuracy.py $(ACCURACY)
	ASBUILT_LARGE_CASES=1 $(BIN)/python -m pytest --quiet tests/test_every_export.py

# The libraries of the systems that the paper names, for the experiments alone.
$(BIN)/.baselines: $(BIN)/.installed | $(BIN)/.built
	VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/maturin develop --release --quiet --extras baselines
	@touch $@

experiments: setup $(BIN)/.baselines ## every table and figure of the paper, into experiments/results and its page of docs (an hour)
	rm -rf out/experiments # clouds as earlier code read them
	for script in experiments/[0-9]*.py; do echo "$$script"; $(BIN)/python "$$script"; done

clean: ## remove what the recipes made
	rm -rf $(VENV) out dist target docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find python tests experiments -name __pycache__ -prune -exec rm -rf {} +
	rm -f python/asbuilt/_core*.so
