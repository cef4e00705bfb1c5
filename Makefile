# Every target builds the virtual environment it needs, from nothing and only once.  Each works
# first in a fresh clone, and in an environment of its own: `make docs VENV=.venv-docs`.

PYTHON ?= python3
PYTEST_ARGS ?=
FUZZ_SECONDS ?= 300
ONLY ?=
SPHINX_ARGS ?=
STEPS ?=
SIZE ?= 1
PYTHONS ?=

VENV := .venv
BIN := $(VENV)/bin
PACKAGES := ppg_env solvers baselines benchmarks

.DEFAULT_GOAL := help
.NOTPARALLEL:  # pip must not run twice in one environment
.PHONY: help demo test test-slow test-nightly fuzz drills coverage wheel neighbours lint types docs format clean

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: $(VENV)/.demo ## Five games in a minute: what each shows, and a picture of each in out/
	@mkdir -p out
	@echo "1 of 5. Two agents head on; no agent pays for the other's crash. The equilibrium (nash)"
	@echo "   costs 2 % more than the optimum (social), and crashes 18 times as often."
	@$(BIN)/ppg compare head_on --speed l1 --objective risk --lam 0.8 --gain 0 --out out/1-selfish.png
	@echo "\n2 of 5. The same with feedback, in the environment: learned players see each other, and do"
	@echo "   better than plans that were made before the start."
	@$(BIN)/ppg compare head_on --speed l1 --objective risk --lam 0.8 --episodes 50000 \
		--players nash,social,ppo-selfish,ppo-social --out out/2-learned.png
	@echo "\n3 of 5. With speed bounded per axis an evasive move costs no time: selfishness is free."
	@$(BIN)/ppg compare head_on --players nash,social,straight --out out/3-free.png
	@echo "\n4 of 5. Six agents change places across a circle: an equilibrium, with proof."
	@$(BIN)/ppg solve "circle(6)" --out out/circle.json
	@$(BIN)/ppg render out/circle.json --out out/4-circle.png
	@echo "\n5 of 5. A door for one: bodies keep apart between the steps, too, and one robot waits."
	@$(BIN)/ppg solve docs/games/door.toml --out out/door.json
	@$(BIN)/ppg render out/door.json --times 2,4,6,8 --out out/5-door.png
	@echo "\nLook at the five pictures in out/; then read README.md, and docs/recipes.md for your own games."

# PYTEST_ARGS="--shuffle 1" runs the tests in the random order of seed 1.
# Python keeps its byte code, whatever the caller's settings: every worker and command reads it.
test test-slow test-nightly: export PYTHONDONTWRITEBYTECODE =

test: $(VENV)/.test ## Run the tests that guard a change (PYTEST_ARGS="-k name" adds options)
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m "not slow" $(PYTEST_ARGS)

# Property tests run again, over more examples.
test-slow: $(VENV)/.test ## Run the other tests: whole trainings, studies, sweeps and proofs
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m "(slow or hypothesis) and not nightly" \
		--hypothesis-profile=thorough $(PYTEST_ARGS)

test-nightly: $(VENV)/.test ## Run the slow cases that take minutes: motion against other solvers
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m "slow and nightly" \
		--hypothesis-profile=thorough $(PYTEST_ARGS)

fuzz: $(VENV)/.test ## Run the property tests over new examples for FUZZ_SECONDS, 300 by default
	$(BIN)/python -m tests.fuzz $(FUZZ_SECONDS)

# ONLY=kills runs one drill; SIZE=0.05 takes minutes, 1 a night.
drills: $(VENV)/.test ## Try to break everything: hostile files, faults, kills, full disks, mutants
	$(BIN)/python -m tests.drills --size $(SIZE) $(ONLY)

# Compiled kernels are measured as plain Python, by the tests of their rules.
coverage: $(VENV)/.coverage ## Measure which lines and branches of ppg_env and solvers tests reach
	rm -f .coverage*
	$(BIN)/coverage run -p -m pytest -q -m "not slow" $(PYTEST_ARGS)
	NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -p -m pytest -q -m "not slow" -W ignore::RuntimeWarning \
		tests/ppg_env/env/test_rules.py tests/ppg_env/env/test_swept.py tests/ppg_env/game
	$(BIN)/coverage combine -q
	$(BIN)/coverage report --skip-covered

# PYTHONS="python3.12 python3.13" installs it with each of these.
wheel: ## Build wheel and source archive, install the wheel outside the tree, and run it
	$(PYTHON) -m tests.packaging.clean_install $(PYTHONS)

# Each example installs what it pins in .neighbours/NAME; ONLY=rllib runs those that begin so, and
# STEPS=20000 changes how long they train; PART=games runs the five short games only, PART=train none.
neighbours: ## Train with each library of examples/, and print one table
	@$(PYTHON) examples/run_neighbours.py --only "$(ONLY)" --steps "$(STEPS)" --part "$(PART)"

lint: $(VENV)/.lint ## Check style, formatting and the direction of imports
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports
	$(BIN)/codespell

types: $(VENV)/.types ## Check types
	$(BIN)/mypy

# SPHINX_ARGS="-D plot_gallery=0 -D nb_execution_mode=off" runs neither examples nor notebooks.
docs: $(VENV)/.docs ## Build the documentation into docs/_build/html, and run its examples
	$(BIN)/sphinx-build -q -W --keep-going $(SPHINX_ARGS) docs docs/_build/html

format: $(VENV)/.lint ## Rewrite the code in the project's style
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

clean: ## Remove the virtual environments and everything built
	rm -rf $(VENV) .venv-* .neighbours build dist out docs/_build docs/pictures *.egg-info
	rm -rf .pytest_cache .ruff_cache .mypy_cache .import_linter_cache .hypothesis
	find $(PACKAGES) tests docs -type d -name __pycache__ -prune -exec rm -rf {} +

$(VENV)/.made:
	@$(PYTHON) -m venv --clear $(VENV) && touch $@

$(VENV)/.demo: INSTALL := -e .[render]
$(VENV)/.test: INSTALL := -e .[render,test,rl,cluster,parquet]
$(VENV)/.coverage: INSTALL := -e .[render,test,rl,cluster,parquet] coverage
$(VENV)/.types: INSTALL := -e .[render,test,rl]
$(VENV)/.docs: INSTALL := -e .[docs]
$(VENV)/.lint: INSTALL := ruff import-linter codespell
$(VENV)/.demo $(VENV)/.test $(VENV)/.coverage $(VENV)/.types $(VENV)/.docs $(VENV)/.lint: \
		pyproject.toml constraints.txt | $(VENV)/.made
	@echo "Installing $(INSTALL) into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt $(INSTALL)
	@touch $@
