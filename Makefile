# `make demo` and `make test` install what they need into .venv first; they need Python 3.11+ and make.
PYTHON ?= python3
BIN := .venv/bin
OUT ?= demo-output
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: setup demo test test-long docs check bench bench-explain bench-peers lock clean

setup: .venv/.ready

.venv/.ready: requirements/lock.txt pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "damper-rig needs Python 3.11 or newer; this is " + sys.version.split()[0] + ". Try: make PYTHON=python3.12 setup")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/lock.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

demo: setup
	$(BIN)/damper-rig demo -o $(OUT)

# Three workers on two processors: tests of servers and rigs wait more than they work.
PYTEST := $(BIN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder

test: setup
	$(PYTEST)

# What `make test` leaves out because it takes long.
test-long: setup
	$(PYTEST) -m 'slow and not bench'

check: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench-explain: setup
	$(BIN)/python -m benchmarks.explain
	$(BIN)/python -m benchmarks.explain.autopilot
	$(BIN)/python -m benchmarks.explain.breakdown

bench: setup
	$(BIN)/python -m benchmarks

# Other tools in an environment of their own: in no lock file.
bench-peers: setup
	test -x .venv-peers/bin/python || $(PYTHON) -m venv .venv-peers
	.venv-peers/bin/python -m pip install --quiet --disable-pip-version-check "jax-sysid>=1.1" "sysidentpy>=0.9"
	$(BIN)/python -m benchmarks.bench_peers .venv-peers/bin/python

# A site in build/site that opens without a network.
docs: setup
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

# Pins every dependency by name and hash, for every platform, and no address; needs `uv` on the PATH.
lock:
	uv pip compile pyproject.toml --extra postgresql --extra fmu --extra dask --extra dbc --extra canopen --extra files --extra notebook --group dev --group docs --universal --python-version 3.11 \
	  --generate-hashes --no-annotate --no-header --no-emit-index-url --no-emit-find-links --output-file requirements/lock.txt

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .hypothesis $(OUT)
