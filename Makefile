# Start here:   make run    the verdict on a four-inertia transmission, with a report
#               make test   all tests but the slow and the long ones
# `make help` lists the rest. Needs: Python 3.11 or newer (with venv), make, git. Everything installs into .venv/.

PYTHON      ?=
MODEL       ?= examples/paper/case3.toml
OUT         ?= out/case3
CONSTRAINTS ?= constraints.txt
PYTEST_ARGS ?=
TESTS       ?=
FUZZ_ARGS   ?=
MUTATION_ARGS ?= --count 100
INTERPRETED := tests/engine/kernels tests/engine/solvers tests/engine/system tests/signals/test_crossing_sums.py tests/analysis/test_modes.py tests/quantities/test_peak_to_peak.py
BASE        ?= HEAD
KINDS       ?=

VENV := .venv
PY   := $(VENV)/bin/python
PIP  := $(PY) -m pip install -qq --disable-pip-version-check -c $(CONSTRAINTS)

# One linear-algebra thread per process: the matrices are small, and the tests run side by side.
export OMP_NUM_THREADS      ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MPLBACKEND           ?= Agg

# Commands and tests start hundreds of processes: none of them compiles a module that another one has compiled.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help run test test-slow test-long plain coverage mutation lint docs same bench hosts peers benchmark-set growth cost orders variants inputs loops advice forecast metrics horizon balance scaling compositions fuzz reliability images constraints dependencies changelog wheel pythons lowest clean distclean

help:           ## list the targets
	@sed -n 's/^\([a-z-]*\):.*##  *\(.*\)/  make \1 \t\2/p' Makefile | expand -t 22

run: $(VENV)/.package       ## simulate MODEL, write the report to OUT, print the verdict
	@$(VENV)/bin/gearrattle run $(MODEL) -o $(OUT)

test: $(VENV)/.test         ## all tests but the slow and the long ones
	$(PY) -m pytest -n auto --dist worksteal -m "not slow and not long" $(TESTS) $(PYTEST_ARGS)

test-slow: $(VENV)/.test    ## browsers and whole processes: the rest of what every change must pass
	$(PY) -m pytest -n auto --dist worksteal -m "slow and not long" $(TESTS) $(PYTEST_ARGS)

test-long: $(VENV)/.test-long  ## the long, seeded attacks; searches over many motions; JupyterLab
	$(PY) -m pytest -n auto -m long $(TESTS) $(PYTEST_ARGS)

plain: $(VENV)/.test        ## kernels as plain Python, and what is tried of them one by one
	NUMBA_DISABLE_JIT=1 $(PY) -m pytest -n auto --dist worksteal -m "not long" $(INTERPRETED) $(PYTEST_ARGS)

coverage: $(VENV)/.test     ## how much of the source all tests but the long ones run, kernels as plain Python included (minutes)
	rm -f .coverage .coverage.*
	$(MAKE) test PYTEST_ARGS="-m 'not long' --cov --cov-report="
	$(MAKE) plain PYTEST_ARGS="--cov --cov-append --cov-report="
	$(PY) -m coverage report --skip-covered --fail-under=95

mutation: $(VENV)/.test     ## wrong signs and comparisons in the kernels that no test notices; MUTATION_ARGS="--count 200 --seed 1" (minutes)
	$(PY) -m tests.mutation --tests $(INTERPRETED) $(MUTATION_ARGS)

lint: $(VENV)/.test $(VENV)/.lint  ## style, types, import contracts
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(VENV)/bin/lint-imports

docs: $(VENV)/.docs         ## the manual: docs/_build/html/index.html
	@rm -rf docs/reference/generated
	$(PY) -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "manual: docs/_build/html/index.html"

same: $(VENV)/.test         ## every difference between what commit BASE and this tree answer (minutes)
	$(PY) -m tests.same $(BASE) $(KINDS)

bench: $(VENV)/.test        ## exact against the fastest plain RK2, same process
	$(PY) -m pytest benchmarks -p no:xdist --benchmark-only --benchmark-timer=time.process_time $(PYTEST_ARGS)

hosts: $(VENV)/.test $(VENV)/.hosts  ## FMUs in a host, FMPy, which brings 182 MB
	$(PY) -m pytest tests/exchange $(PYTEST_ARGS)

peers: $(VENV)/.test $(VENV)/.peers  ## exact against other solvers: writes docs/reference/peers.md (minutes)
	$(PY) -m benchmarks.peers

benchmark-set: $(VENV)/.test $(VENV)/.peers  ## problems, references and results of clearance-benchmarks/ (an hour)
	$(PY) -m benchmarks.benchmark_set

cost: $(VENV)/.package      ## what a step and a crossing cost: writes docs/reference/cost.md
	$(PY) -m benchmarks.cost

orders: $(VENV)/.package    ## spectra and orders of ten million samples: writes docs/reference/orders.md
	$(PY) -m benchmarks.orders

variants: $(VENV)/.package  ## variants of a driveline a second, on one thread and on two
	$(PY) -m benchmarks.variants
inputs: $(VENV)/.package    ## friction, alternation, records, run-ups: what each costs beside the same run without
	$(PY) -m benchmarks.inputs

loops: $(VENV)/.test         ## fits of torque-angle loops against SciPy's least squares: writes docs/reference/loops.md (minutes)
	$(PY) -m benchmarks.loops

growth: $(VENV)/.package    ## cost against the number of inertias: writes docs/reference/growth.md (minutes)
	$(PY) -m benchmarks.growth

advice: $(VENV)/.package    ## how often advice comes true: writes docs/reference/advice.md (minutes)
	$(PY) -m benchmarks.advice

forecast: $(VENV)/.package  ## forecasts of contact ratios against exact runs: writes docs/reference/forecast.md (minutes)
	$(PY) -m benchmarks.forecast

metrics: $(VENV)/.package   ## what sampling rattle metrics need: writes docs/reference/metrics.md
	$(PY) -m benchmarks.metrics

horizon: $(VENV)/.test      ## what rounding comes to at the predictability horizon: writes docs/reference/horizon.md (minutes)
	$(PY) -m benchmarks.horizon

balance: $(VENV)/.package $(VENV)/pyharm  ## harmonic balance against shooting: writes docs/reference/harmonic_balance.md
	$(PY) -m benchmarks.harmonic_balance $(VENV)/pyharm/bin/python

scaling: $(VENV)/.test      ## what schedulers of studies cost beside the cases: writes docs/reference/scaling.md (minutes)
	$(PY) -m benchmarks.scaling

compositions: $(VENV)/.test ## what works with what: writes docs/reference/compositions.md (minutes)
	$(PY) -m tests.compositions

fuzz: $(VENV)/.test         ## damaged input for every reader; FUZZ_ARGS="--inputs 50000" (an hour or more)
	$(PY) -m tests.fuzz $(FUZZ_ARGS)

reliability: $(VENV)/.test  ## what was attacked, how often, what failed: writes docs/reference/reliability.md (minutes)
	$(PY) -m benchmarks.reliability

images: $(VENV)/.docs       ## redraw the pictures in docs/images
	$(PY) docs/images/draw.py
	$(PY) docs/images/packages.py
	$(PY) docs/images/workbench_pictures.py

constraints: $(VENV)/.test-long $(VENV)/.lint $(VENV)/.docs $(VENV)/.hosts $(VENV)/.peers  ## rewrite constraints.txt from what .venv holds
	{ grep '^#' constraints.txt; $(PY) -m pip freeze --exclude-editable --exclude pip --exclude setuptools; } > $(VENV)/pins
	mv $(VENV)/pins constraints.txt

dependencies: $(VENV)/.test  ## licences and bill of materials (out/dependencies) of what is installed, known vulnerabilities (osv.dev) of CONSTRAINTS; Error 3: no answer
	$(PY) .ci/dependencies out/dependencies
	@$(PY) .ci/vulnerabilities $(CONSTRAINTS)

changelog:      ## put changes/ under the version's heading in CHANGELOG.md; DATE=2026-12-31 dates it for a release
	@$(or $(PYTHON),python3) .ci/changelog $(DATE)

wheel: $(VENV)/.python       ## build wheel and sdist into out/dist, install both clean, run an example outside the tree
	.ci/wheel $(PY)

pythons:        ## TESTS under every CPython 3.11 to 3.14 of this machine (minutes)
	.ci/pythons $(TESTS)

lowest:         ## TESTS with the lower bounds of pyproject.toml, exactly (minutes)
	.ci/lowest $(TESTS)

clean:          ## remove what was built, keep .venv
	rm -rf .coverage .coverage.* out dist build docs/_build docs/reference/generated .pytest_cache .mypy_cache .ruff_cache \
	  .import_linter_cache .hypothesis .benchmarks
	find src tests examples benchmarks docs -name __pycache__ -type d -exec rm -rf {} +

distclean: clean ## remove .venv as well
	rm -rf $(VENV)

# The environment: each stamp is older than what it was made from only if that has changed since.
$(VENV)/.python:
	@usable() { "$$1" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; }; \
	if usable $(PY); then touch $@; exit 0; fi; \
	for python in $(or $(PYTHON),python3 python3.13 python3.12 python3.11 python3.14 python); do \
	  usable "$$python" || continue; \
	  echo "environment: $$("$$python" --version) in $(VENV)/"; \
	  rm -rf $(VENV) && "$$python" -m venv $(VENV) && touch $@; exit $$?; \
	done; \
	{ echo "Found no Python 3.11 or newer that has venv and ensurepip (tried: $(or $(PYTHON),python3, python3.11 to 3.14, python))."; \
	  echo "Install one (Debian, Ubuntu: apt install python3 python3-venv) or name it: make run PYTHON=/path/to/python3"; } >&2; \
	exit 1

$(VENV)/.package: $(VENV)/.python pyproject.toml constraints.txt
	@echo "installing gearrattle (a minute or two, once)"
	@$(PIP) --editable .
	@touch $@

$(VENV)/pyharm: $(VENV)/.python
	@echo "installing pyHarm in an environment of its own: it asks for older packages"
	@$(PY) -m venv $@ && $@/bin/pip install -qq --disable-pip-version-check 'pyHarm-os>=1.2' || { rm -rf $@; exit 1; }

$(VENV)/.test $(VENV)/.test-long $(VENV)/.lint $(VENV)/.docs $(VENV)/.hosts $(VENV)/.peers: $(VENV)/.%: $(VENV)/.package
	@echo "installing what 'make $*' needs"
	@$(PIP) --editable '.[$*]'
	@touch $@
