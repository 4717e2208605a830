# make demo     install into .venv and audit the demo mesh
# make test     install the wheel into .venv and run the test suite on it
# make check    everything CI runs
# make fuzz     thousands of damaged files through the readers (long)
# make torture  every metric on 110,000 random and ugly cells a type, signs against rationals (long)
# make bench    side-by-side benchmarks (long)
# make samples  regenerate samples/ (needs gmsh)

PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
SOURCES = pyproject.toml README.md $(shell find audit reports -type f -not -path '*/__pycache__/*')

.PHONY: demo test lint types check fuzz torture bench samples clean

demo: $(VENV)/.runtime
	$(BIN)/meshwright audit samples/demo.msh.gz

test: $(VENV)/.dev
	cd tests && ../$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(VENV)/.dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(VENV)/.dev
	cd tests && ../$(BIN)/mypy --config-file ../pyproject.toml -p meshwright.audit -p meshwright.reports

check: lint types test

fuzz: $(VENV)/.dev
	cd tests && ../$(BIN)/python -m pytest -m fuzz -n 2

torture: $(VENV)/.dev
	cd tests && MESHWRIGHT_MANY=1 ../$(BIN)/python -m pytest -n 2 test_ugly_cells.py

bench: $(VENV)/.dev
	$(BIN)/python benchmarks/run_all.py

samples: $(VENV)/.dev
	$(BIN)/python samples/make.py

# The wheel is installed, not the checkout: tests then run what users get.
$(VENV)/.runtime: $(SOURCES)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check .
	touch $@

$(VENV)/.dev: $(SOURCES)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[dev,oracles]'
	touch $@

clean:
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
