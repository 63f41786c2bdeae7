# nsspice: all tasks of the project.  `make run` and `make test` do the whole set-up by themselves.
#
#   make run     virtual environment, build, simulate a real netlist, leave CSV and plot
#   make test    everything a change must pass: Rust and Python tests, formats, types, lints
#   make fmt lint type bench work-precision cross-check docs playground mutations soak clean

PYTHON ?= python3
VENV   ?= .venv
DECK   ?= netlists/converters/buck.net

BIN    := $(VENV)/bin
CRATE  := nsspice/core/Cargo.toml
# cargo test links a small program against libpython: let it find the one of the environment
export PYO3_PYTHON := $(abspath $(BIN)/python)
# the tests start many processes: each would compile the package again
export PYTHONDONTWRITEBYTECODE :=
LIBPYTHON = $$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_config_var("LIBDIR") or "")')
RUST_SOURCES := $(shell find nsspice/core/src -name '*.rs' 2>/dev/null) nsspice/core/Cargo.lock

.PHONY: run test setup check-rust rust-tools ngspice browser fmt lint type unit rust-test bench core-bench bench-compare work-precision cross-check coverage docs playground mutations soak wheel clean

run: $(VENV)/.core
	$(BIN)/nsspice run $(DECK) --plot
	@echo "left here: $$(ls $(basename $(notdir $(DECK))).*)"

test: lint type rust-test ngspice browser unit

# ------------------------------------------------------------------ set-up

setup: $(VENV)/.core

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "nsspice needs Python 3.10 or newer; say which one: make PYTHON=python3.12 ..."; exit 1; }
	$(PYTHON) -m venv $(VENV) || \
	  { echo "this Python cannot make virtual environments; on Debian: apt install python3-venv"; exit 1; }

# the package in editable mode: Python files are used in place, the core is compiled
$(VENV)/.core: $(BIN)/python pyproject.toml $(CRATE) $(RUST_SOURCES) | check-rust
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/.dev: $(VENV)/.core
	$(BIN)/python -m pip install --quiet --editable '.[dev,ngspice]'
	@touch $@

check-rust:
	@command -v cargo >/dev/null || \
	  { echo "nsspice compiles its core: install Rust first (rustup), then try again"; exit 1; }

rust-tools: check-rust
	@cargo clippy --version >/dev/null 2>&1 || rustup component add clippy
	@cargo fmt --version >/dev/null 2>&1 || rustup component add rustfmt

# the library that the cross-checks compare with; installed by the system's package manager
ngspice: $(BIN)/python
	@sh tools/ngspice_library.sh $(BIN)/python

# a headless browser, in which the tests open a report
browser:
	@sh tools/browser.sh

# ------------------------------------------------------------------ checks

lint: $(VENV)/.dev rust-tools
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell docs nsspice tests tools README.md CONTRIBUTING.md CHANGELOG.md
	$(BIN)/python tools/words.py
	cargo fmt --manifest-path $(CRATE) --check
	cargo clippy --manifest-path $(CRATE) --all-targets --locked -- -D warnings

type: $(VENV)/.dev
	$(BIN)/mypy

rust-test: $(BIN)/python | check-rust
	LD_LIBRARY_PATH="$(LIBPYTHON):$$LD_LIBRARY_PATH" cargo test --manifest-path $(CRATE) --locked

unit: $(VENV)/.dev
	$(BIN)/python -m pytest -m 'not soak' -n auto --dist worksteal

fmt: $(VENV)/.dev rust-tools
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	cargo fmt --manifest-path $(CRATE)

# ------------------------------------------------------------------ more

bench: $(VENV)/.dev core-bench
	$(BIN)/python -m pytest tests/benchmarks -o addopts= -o python_files='bench_*.py' -s
	$(MAKE) work-precision

# steps, the structural equations and instants one by one, by criterion
core-bench: $(BIN)/python | check-rust
	LD_LIBRARY_PATH="$(LIBPYTHON):$$LD_LIBRARY_PATH" cargo bench --bench hot_paths --manifest-path $(CRATE) --locked

# both commits built, timed in turn, ratios: BASE=REV
bench-compare: check-rust
	$(PYTHON) tools/compare_commits.py --base $(or $(BASE),HEAD~1)

# what accuracy costs here and with ngspice, Pulsim and Siconos; writes docs/reference/work-precision.md
work-precision: $(VENV)/.dev ngspice
	$(BIN)/python tools/work_precision.py --write docs/reference/work-precision.md

# all netlists against ngspice; writes the tables of docs/reference/ngspice.md
cross-check: $(VENV)/.dev ngspice
	$(BIN)/python tools/ngspice_table.py --write docs/reference/ngspice.md

# lines of the Python package that the tests run; the threshold only rises
coverage: $(VENV)/.dev
	$(BIN)/python -m pytest -m 'not soak' -n auto --dist worksteal --cov=nsspice --cov-report=term:skip-covered

# does the certificate see faults of the engines?  A damaged core is compiled into target-faults
mutations: $(VENV)/.dev
	$(BIN)/python tools/mutations.py

soak: $(VENV)/.dev
	$(BIN)/python tools/soak.py
	$(BIN)/python tools/sweep_oracle.py --count 10
	$(BIN)/python -m pytest -m soak

docs: $(VENV)/.dev
	$(BIN)/mkdocs build --strict
	$(BIN)/python -m pytest tests/docs

# the core for browsers, which `make docs` then puts into the site; needs Debian's packages, cargo, npm
playground: $(VENV)/.dev
	$(BIN)/python tools/playground/build.py

wheel: $(VENV)/.dev
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .

clean:
	rm -rf $(VENV) build dist site nsspice/core/target nsspice/*.so
