# Every target builds the virtual environment it needs, from nothing and only once.

PYTHON ?= python3
PYTEST_ARGS ?=

VENV := .venv
BIN := $(VENV)/bin
PACKAGES := ppg_env solvers baselines benchmarks

.DEFAULT_GOAL := help
.NOTPARALLEL:  # pip must not run twice in one environment
.PHONY: help demo test lint types docs format clean

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: $(VENV)/.demo ## Compare the players in the paper's scenarios: tables, and pictures in out/
	$(BIN)/ppg compare head_on --speed l1 --objective risk --lam 0.8 --gain 0 --out out/headline.png
	$(BIN)/ppg compare head_on --speed l1 --objective risk --lam 0.8 --episodes 50000 \
		--players nash,social,ppo-selfish,ppo-social --out out/learned.png
	@for game in opposing head_on parallel intersection intersection3; do \
		echo "$(BIN)/ppg compare $$game"; $(BIN)/ppg compare $$game || exit 1; done

test: $(VENV)/.test ## Run the tests on two processes (PYTEST_ARGS="-k name" adds options)
	$(BIN)/python -m pytest -n 2 -q $(PYTEST_ARGS)

lint: $(VENV)/.test ## Check style, formatting and the direction of imports
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports
	$(BIN)/codespell

types: $(VENV)/.test ## Check types
	$(BIN)/mypy

docs: $(VENV)/.docs ## Build the documentation into docs/_build/html
	$(BIN)/sphinx-build -q -W --keep-going docs docs/_build/html

format: $(VENV)/.test ## Rewrite the code in the project's style
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

clean: ## Remove the virtual environment and everything built
	rm -rf $(VENV) build dist out docs/_build *.egg-info
	rm -rf .pytest_cache .ruff_cache .mypy_cache .import_linter_cache .hypothesis
	find $(PACKAGES) tests docs -type d -name __pycache__ -prune -exec rm -rf {} +

$(VENV)/.made:
	@$(PYTHON) -m venv --clear $(VENV) && touch $@

$(VENV)/.demo: EXTRAS := render
$(VENV)/.test: EXTRAS := render,test,rl,cluster,parquet
$(VENV)/.docs: EXTRAS := docs
$(VENV)/.demo $(VENV)/.test $(VENV)/.docs: pyproject.toml constraints.txt | $(VENV)/.made
	@echo "Installing .[$(EXTRAS)] into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[$(EXTRAS)]"
	@touch $@
