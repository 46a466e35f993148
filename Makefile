# What is done with a checkout.  Every target sets up .venv itself; PYTHON names another interpreter (>= 3.11).
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do \
	$$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$p; break; }; done)
BIN := .venv/bin
RUNS := .venv/runs
TESTS := .venv/tests
BENCH := .venv/bench
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable

.PHONY: demo cell test test-times lint docs house answers bench bench-full clean

demo: $(RUNS)  ## one inspection of the demonstration bulkhead
	$(BIN)/relmodel demo

cell: $(RUNS)  ## the cell of two arms, table and bulkhead, in the store cell.duckdb, and its picture
	$(BIN)/python -m examples.cell cell.duckdb --picture cell.png

test: $(TESTS)  ## all tests; those over the test data too where RELMODEL_TEST_DATA names its folder
	$(BIN)/python -m pytest --numprocesses auto

test-times: $(TESTS)  ## all tests, and which forty took longest
	$(BIN)/python -m pytest --numprocesses auto --durations=40

lint: $(TESTS)  ## ruff and mypy
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(TESTS)  ## the documentation as a site, docs/_build/index.html; needs no network, and a warning is an error
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going docs docs/_build

house: $(TESTS)  ## how big the house is, held against its limits
	$(BIN)/python -m benchmarks.house

answers: $(TESTS)  ## whether answers are those of the commit BASE, and what they cost beside it
	$(BIN)/python -m benchmarks.answers $(BASE)

bench: $(BENCH)  ## the benchmarks' quick preset, under 20 minutes, and one page of what they print: build/benchmarks.html
	$(BIN)/python -m benchmarks.run

bench-full: $(BENCH)  ## all of every benchmark: hours
	$(BIN)/python -m benchmarks.run --full

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache build dist docs/_build docs/reference

# What tests need besides (Spark, Java, PostgreSQL) is large: the demonstration does not wait for it.
$(RUNS): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "relmodel needs Python 3.11 or newer with the venv module: install it, or run make PYTHON=..." >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(INSTALL) '.[step]'
	touch $@

$(TESTS): $(RUNS)
	$(INSTALL) '.[test,lint,docs]'
	touch $@

$(BENCH): $(TESTS)
	$(INSTALL) '.[bench]'
	touch $@
