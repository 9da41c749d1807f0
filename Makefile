# vpm: every command sets up what it needs, in a fresh clone, with Python >= 3.11, Rust (cargo) and make.
#
# Settings, as in `make test PYTEST_ARGS="-k friction"`:
#   PYTHON       the interpreter that makes .venv            (python3)
#   DEMO_OUT     the folder that the demo's report goes to   (demo-report)
#   DATA         the folder of public benchmarks            (data)
#   CASES FIRST  count and first seed of `make fuzz`        (20000, 1)
#   SHARD        the part of all mutants of `make mutants`  (0/200)
#   PYTEST_ARGS  CARGO_ARGS                                  passed on

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.SUFFIXES:
.PHONY: help demo test test-rust test-python test-nightly fuzz fuzz-files fuzz-c fuzz-rust coverage mutants reference validation lint lint-rust lint-python bench peers chirp narx-peers bench-counts c-library bench-diagnosis benchmarks bench-lisdd docs docs-rust figures site package wheels clean

PYTHON ?= python3
DEMO_OUT ?= demo-report
DATA ?= data
CASES ?= 20000
FIRST ?= 1
SHARD ?= 0/200
PYTEST_ARGS ?=
CARGO_ARGS ?=

VENV := .venv
BIN := $(VENV)/bin
# All paths are relative, so that the folder of the clone may have any name; this one has to be absolute.
# With it every command compiles the bindings against the same interpreter, so that cargo builds them once.
export PYO3_PYTHON = $(CURDIR)/$(BIN)/python

# Programs that tests start would otherwise compile all of the package anew, a second each.
unexport PYTHONDONTWRITEBYTECODE

# Processor time of one program of Rust tests, s: an endless loop ends with SIGXCPU.
RUST_SECONDS := 3600

# A virtual environment in a folder, by what this Python has for it.
make-venv = if "$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null; then "$(PYTHON)" -m venv $(1); \
	elif "$(PYTHON)" -m virtualenv --version >/dev/null 2>&1; then "$(PYTHON)" -m virtualenv $(1); \
	elif command -v virtualenv >/dev/null; then virtualenv --python "$(PYTHON)" $(1); \
	else echo "vpm keeps its tools in $(1), but this '$(PYTHON)' can make none (no venv, no virtualenv); install your system's python3-venv package and try again" >&2; false; fi

RUST_SOURCES := Cargo.toml $(wildcard Cargo.lock) \
	$(shell find crates -path '*/src/*' -name '*.rs' -o -name 'Cargo.toml')

help: ## this list
	@echo 'vpm: the commands (each does all of its own set-up)'
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-15s %s\n", $$1, $$2 }' Makefile

# A wheel in dist/ that was made from these very sources spares the compiler, unless the core has been compiled already.
demo: ## find the hidden effect in a recorded log; the report goes to demo-report/
	@if ! $(MAKE) --question --no-print-directory $(VENV)/.installed >/dev/null 2>&1 && \
	    wheel=$$("$(PYTHON)" release/sources.py dist) && $(call make-venv,dist/venv) && \
	    dist/venv/bin/python -m pip install --quiet --force-reinstall --no-deps "$$wheel" && \
	    dist/venv/bin/python -m pip install --quiet "$$wheel[report]"; then \
	  echo "using $$wheel"; dist/venv/bin/vpm demo --out "$(DEMO_OUT)"; \
	else $(MAKE) --no-print-directory $(VENV)/.installed && $(BIN)/vpm demo --out "$(DEMO_OUT)"; fi

test: test-rust test-python ## all tests, Rust and Python

# What is compiled first has no limit. Of a program beyond it, or of one that stands still because its threads wait for each other, the
# tests that run "for over 60 seconds" have been named before.
test-rust: | $(VENV)/.tools-found
	cargo test --no-run $(CARGO_ARGS)
	ulimit -S -t $(RUST_SECONDS); $(PYTHON) tests/support/stalls.py cargo test $(CARGO_ARGS)

reference: | $(VENV)/.tools-found ## integrators against an adaptive solver, which takes minutes to build
	cargo test --features reference --test reference $(CARGO_ARGS)

# Test files side by side on all cores; the linear algebra of each stays on one.
test-python: $(VENV)/.installed
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses auto --dist loadfile $(PYTEST_ARGS)

test-nightly: $(VENV)/.installed ## the claims of some tests on many more cases, which takes minutes
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses auto --dist worksteal -m nightly $(PYTEST_ARGS)

fuzz: fuzz-files fuzz-c fuzz-rust ## all of the following three

fuzz-files: $(VENV)/.installed ## CASES damaged files from seed FIRST on: refused, or finite numbers within limits
	cd tests && OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 ../$(BIN)/python -m fuzz $(CASES) $(FIRST)

fuzz-c: $(VENV)/.installed ## the C library and C source of the examples, watched by address and behaviour sanitizers
	cargo build --release --package vpm-c $(CARGO_ARGS)
	cd tests && ../$(BIN)/python -m fuzz.sanitized ../target/release/libvpm.a

# In the folder target of the workspace, which has most of it; `cargo +nightly fuzz run compiled` of cargo-fuzz works too.
fuzz-rust: $(VENV)/.installed ## libFuzzer on what the core reads from texts, CASES for each target
	cd tests && ../$(BIN)/python -m fuzz.seeds ../fuzz/corpus
	cd fuzz && RUSTC_WRAPPER='$(CURDIR)/fuzz/instrumented' CARGO_TARGET_DIR='$(CURDIR)/target' cargo build --release
	for target in description compiled c_interface; do \
	  target/release/$$target -runs=$(CASES) -seed=$(FIRST) -max_len=100000 -timeout=3600 -rss_limit_mb=2048 \
	    -artifact_prefix=fuzz/ -print_final_stats=1 fuzz/corpus/$$target || exit 1; \
	done

coverage: $(VENV)/.installed target/tools/bin/cargo-llvm-cov ## lines that the tests run, by room; too few are an error; takes an hour
	rustup component add llvm-tools
	mkdir -p build/coverage
	$(CARGO_TOOL) llvm-cov --package vpm-core --json --summary-only --output-path build/coverage/core.json $(CARGO_ARGS)
	$(BIN)/python -m coverage erase
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m coverage run -m pytest $(PYTEST_ARGS)
	$(BIN)/python -m coverage combine --quiet
	$(BIN)/python -m coverage json --quiet -o build/coverage/python.json
	$(BIN)/python tests/support/covered.py build/coverage/python.json build/coverage/core.json

# Shares of all 5000 mutants are drawn evenly. Each mutant compiles the core and its tests anew, and runs them, for some minutes.
mutants: $(VENV)/.installed target/tools/bin/cargo-mutants ## one mistake in a law of the core at a time, SHARD of them: do the tests notice?
	$(CARGO_TOOL) mutants --package vpm-core --shard $(SHARD) --sharding round-robin --output build $(CARGO_ARGS)

lint: lint-rust lint-python ## formatting, static checks and types, all as errors

lint-rust: $(VENV)/.installed
	cargo fmt --all --check
	cargo clippy --workspace --all-targets $(CARGO_ARGS) -- -D warnings

lint-python: $(VENV)/.installed
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m mypy
	$(BIN)/python -m mypy.stubtest --mypy-config-file pyproject.toml vpm._core
	$(BIN)/lint-imports

validation: $(VENV)/.installed ## compute the validation table anew, into docs/validation.md and .csv
	cd tests && PYTHONPATH=support ../$(BIN)/python -m validation

bench: | $(VENV)/.tools-found ## time the core: one result per line, with its spread
	cargo bench $(CARGO_ARGS)

bench-counts: $(VENV)/.installed ## count the instructions of one call of the recursions (needs valgrind)
	$(BIN)/python benches/peers/instruction_counts.py

peers: $(VENV)/.installed ## time vpm beside other engines, which this installs; writes docs/performance.md
	$(BIN)/python -m pip install --quiet 'exudyn>=1.10' 'mujoco>=3.3' 'pin>=3.0' 'cmeel-eigen>=3.4' 'casadi>=3.6' 'numba>=0.60' 'sysidentpy>=0.9'
	$(BIN)/python benches/peers/run.py

chirp: $(VENV)/.installed ## time the servo-cylinder beside the solvers that are installed (C, CasADi, SciPy with Numba)
	$(BIN)/python benches/peers/servo_chirp.py

narx-peers: $(VENV)/.installed ## time a NARX model beside what is installed (C, Numba, sysidentpy)
	$(BIN)/python benches/peers/narx.py

bench-diagnosis: $(VENV)/.installed ## time whole diagnoses of an axis and of a flexible arm; writes into docs/performance.md
	$(BIN)/python benches/diagnosis/diagnosis.py --write

benchmarks: $(VENV)/.installed ## score models on public benchmarks in the folder DATA; writes docs/benchmarks.md
	OMP_NUM_THREADS=1 $(BIN)/python benches/public/public_scores.py --data "$(DATA)" --page docs/benchmarks.md

bench-lisdd: $(VENV)/.installed ## put the diagnosis beside LISDD, a baseline, on blind cases of an axis, for a quarter of an hour
	OMP_NUM_THREADS=1 $(BIN)/python benches/diagnosis/side_by_side.py --seeds 9100-9102

c-library: | $(VENV)/.tools-found ## build the C library: header, static and shared library in dist/c
	cargo build --release --package vpm-c $(CARGO_ARGS)
	mkdir -p dist/c
	cp crates/vpm-c/include/vpm.h target/release/libvpm.* dist/c
	rm -f dist/c/*.d dist/c/*.rlib
	@ls -l dist/c

figures: $(VENV)/.installed ## draw the pictures of docs/ anew, from the package
	$(BIN)/python docs/figures/validity.py
	$(BIN)/python docs/figures/hyl.py
	$(BIN)/python docs/figures/oil.py
	$(BIN)/python docs/figures/effects.py
	$(BIN)/python docs/figures/view.py

docs: $(VENV)/.installed docs-rust ## run every snippet of the documents; build the Rust documentation
	$(BIN)/python -m pytest tests/project/test_docs.py $(PYTEST_ARGS)

docs-rust: $(VENV)/.installed ## build the Rust documentation
	RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps $(CARGO_ARGS)

site: $(VENV)/.installed ## build the site of the documents into build/site, with pictures that the examples draw; checks links
	$(BIN)/python -m pip install --quiet 'mkdocs-material>=9.5,<10' 'mkdocstrings[python]>=0.27' 'latex2mathml>=3.77'
	rm -rf build
	OMP_NUM_THREADS=1 $(BIN)/python docs/site/pages.py build/pages
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo 'open build/site/index.html'

package: $(VENV)/.installed ## build the wheel and the source distribution into dist/
	rm -rf dist
	$(BIN)/python -m maturin sdist --out dist
	$(BIN)/python -m pip install --quiet 'twine>=6'
	$(BIN)/python release/wheels.py --native
	@# The core is checked from the source distribution alone, so that nothing it is compiled from is left out.
	mkdir dist/unpacked
	tar -xzf dist/*.tar.gz -C dist/unpacked --strip-components 1
	CARGO_TARGET_DIR='$(CURDIR)/target' cargo check --manifest-path dist/unpacked/Cargo.toml --package vpm-py --quiet
	rm -rf dist/unpacked
	@ls -l dist

wheels: $(VENV)/.tools ## build wheels for Linux on x86-64 and aarch64 into dist/, and check them
	$(BIN)/python -m pip install --quiet 'auditwheel>=6.2' 'twine>=6' 'ziglang>=0.13'
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python release/wheels.py
	@ls -l dist

clean: ## remove everything that the commands made
	rm -rf $(VENV) target dist build demo-report .hypothesis .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
	find python tests -name '__pycache__' -type d -prune -exec rm -rf {} +
	find python -name '_core*.so' -delete

# ---- set-up ---------------------------------------------------------------------------------------------------------

# What has to be on the machine; one sentence about what is not.
$(VENV)/.tools-found:
	@command -v "$(PYTHON)" >/dev/null || { \
	  echo "vpm needs Python 3.11 or newer, but there is no '$(PYTHON)' here; install it, or name it: make PYTHON=python3.12" >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; v = sys.version_info; sys.exit(0 if v >= (3, 11) else "vpm needs Python 3.11 or newer, but %s is %d.%d; name a newer one: make PYTHON=python3.12" % (sys.executable, v[0], v[1]))'
	@command -v cargo >/dev/null || { \
	  echo "vpm needs Rust to build its core, but there is no 'cargo' here; install Rust (rustup or your system's package) and try again" >&2; exit 1; }
	@mkdir -p $(VENV)
	@touch $@

$(VENV)/.made: | $(VENV)/.tools-found
	@$(call make-venv,$(VENV))
	@touch $@

# Third-party packages: again only when pyproject.toml changes.
$(VENV)/.tools: pyproject.toml | $(VENV)/.made
	$(BIN)/python -m pip install --quiet 'maturin>=1.7,<2'
	@touch $@

# The compiled core, release build: again when a Rust source changes. Python sources are used where they stand.
$(VENV)/.installed: pyproject.toml $(RUST_SOURCES) | $(VENV)/.tools
	@echo 'building the core and installing vpm into $(VENV); the first time this takes a few minutes'
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m pip install --quiet --no-build-isolation --editable '.[dev]'
	@# A peer of the tests, of pure Python; its list of dependencies, all there already, would hold NumPy back.
	$(BIN)/python -m pip install --quiet --no-deps 'sysidentpy>=0.9'
	@touch $@

# Programs of cargo that only some commands need, in the folder of what is compiled.
CARGO_TOOL := PATH="$(CURDIR)/target/tools/bin:$$PATH" cargo

target/tools/bin/cargo-%: | $(VENV)/.tools-found
	cargo install --quiet --locked --root target/tools cargo-$*
