# One target a habit. Everything is installed into .venv, which `make clean` removes.
PYTHON ?= python3.11
ARGS ?=
BIN := .venv/bin
INSTALL := $(BIN)/python -m pip install --disable-pip-version-check --quiet --constraint constraints.txt

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help evaluate test clients check format benchmark soak docs gallery clean

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*  ## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

evaluate: .venv/core  ## the main job: TDE, ATDE and ARTDE beside the thesis, into runs/main (more options: ARGS=...)
	$(BIN)/artde-gym evaluate --episodes 3 --out runs/main $(ARGS)

test: check  ## all checks, then all tests (a selection: ARGS=...)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 $(ARGS)

clients: .venv/core  ## train with learning libraries, in environments of their own (some: ARGS="tianshou rllib")
	$(BIN)/python scripts/clients.py $(ARGS)

check: .venv/dev  ## format, lint, types and import contracts
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/basedpyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

format: .venv/dev  ## format and mend what can be mended
	$(BIN)/ruff check --fix-only
	$(BIN)/ruff format

benchmark: .venv/core  ## speed, as ratios in one run
	$(BIN)/artde-gym benchmark $(ARGS)

soak: .venv/dev  ## hours: walks, short episodes, damaged files, random calls, kills (a part: ARGS=...)
	OMP_NUM_THREADS=1 $(BIN)/python scripts/soak.py $(ARGS)

docs: .venv/docs  ## build the documentation into site/, warnings are errors (to be read in a browser, also without a server)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "artde-gym: open site/index.html"

gallery: .venv/dev  ## remake the pictures of the README and of the documentation (needs chromium; some minutes)
	OMP_NUM_THREADS=1 $(BIN)/python scripts/gallery.py

clean:  ## remove the environment and all caches, keep runs
	rm -rf .venv .venv-clients build dist site .hypothesis .import_linter_cache .pytest_cache .ruff_cache *.egg-info
	find artde_gym baselines controllers scripts tests -name __pycache__ -exec rm -rf {} +

.venv/core: pyproject.toml constraints.txt scripts/build_backend.py
	@$(PYTHON) -c 'import ensurepip, sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null || { \
		echo "artde-gym: make needs CPython 3.11 with its venv module (Debian: apt install python3.11-venv), and" >&2; \
		echo "\`$(PYTHON)' is none. Another one: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@echo "artde-gym: installing into .venv"
	@$(PYTHON) -m venv .venv
	@$(INSTALL) --editable .
	@touch $@

.venv/docs: .venv/core
	@echo "artde-gym: installing the extra docs into .venv"
	@$(INSTALL) --editable '.[docs]'
	@touch $@

.venv/dev: .venv/core
	@echo "artde-gym: installing the extras dev, docs, mujoco, rl and video into .venv"
	@$(INSTALL) --editable '.[dev,docs,mujoco,rl,video]'
	@touch $@
