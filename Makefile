# make demo     install into .venv, audit the demo mesh and write demo/report.html
# make viewer   build the 3-D view of the report from its source (needs node)
# make test     install the wheel into .venv and run the test suite on it
# make check    everything CI runs
# make fuzz     thousands of damaged files through the readers (long)
# make torture  every metric on 110,000 random and ugly cells a type, signs against rationals (long)
# make bench    side-by-side benchmarks (long)
# make samples  regenerate samples/ (needs gmsh)

PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
SOURCES = pyproject.toml README.md $(shell find audit repair reports -type f -not -path '*/__pycache__/*')

.PHONY: viewer demo test lint types check fuzz torture bench samples clean

demo: $(VENV)/.runtime
	mkdir -p demo
	$(BIN)/meshwright audit samples/demo.msh.gz --profile cfd --html demo/report.html
	@echo "report to look at: $(abspath demo/report.html)"

viewer:
	cd reports/html/viewer && npm ci --no-audit --no-fund && node build.mjs

test: $(VENV)/.dev tests/schemas/node_modules
	cd tests && ../$(BIN)/python -m pytest -n 2 --dist worksteal

lint: $(VENV)/.dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(VENV)/.dev
	cd tests && ../$(BIN)/mypy --config-file ../pyproject.toml -p meshwright.audit -p meshwright.repair -p meshwright.reports

check: lint types test

fuzz: $(VENV)/.dev
	cd tests && ../$(BIN)/python -m pytest -m fuzz -n 2

torture: $(VENV)/.dev
	cd tests && MESHWRIGHT_MANY=1 ../$(BIN)/python -m pytest -n 2 test_ugly_cells.py

bench: $(VENV)/.dev
	$(BIN)/python benchmarks/run_all.py

samples: $(VENV)/.dev
	$(BIN)/python samples/make.py

# Published schemas that come as packages of npm; tests that need them skip where there is no npm.
tests/schemas/node_modules: tests/schemas/package-lock.json
	-cd tests/schemas && npm ci --ignore-scripts --legacy-peer-deps --no-audit --no-fund --silent
	@mkdir -p $@ && touch $@

# The wheel is installed, not the checkout: tests then run what users get.
$(VENV)/.runtime: $(SOURCES)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check .
	touch $@

$(VENV)/.dev: $(SOURCES)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[dev,oracles,surfaces]'
	touch $@

clean:
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
