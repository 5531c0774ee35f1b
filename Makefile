# One target a habit. Everything is installed into .venv, which `make clean` removes.
# Any CPython from 3.11 on: make PYTHON=python3.13 VENV=.venv-3.13 EXTRAS=test,docs,video tests
# that of PyBullet's wheels, if there is one
PYTHON ?= $(shell command -v python3.11 || echo python3)
VENV ?= .venv
EXTRAS ?= dev,docs,rl,video
LEAST ?= 0
ARGS ?=
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --disable-pip-version-check --quiet
INSTALL := $(PIP) --constraint constraints.txt
# three for two cores: some tests wait for a clock or a browser
TESTS = OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 3 --dist worksteal --at-least $(LEAST)
# packages of CUDA, which no constraint is needed for, since CPU builds of PyTorch do not ask for them
CUDA := ^(cuda|nvidia)-|^triton=

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help evaluate test tests clients coverage lowest check format benchmark soak docs gallery viewer constraints dist clean

help:  ## list the targets
	@awk -F ':.*  ## ' '/^[a-z]+:.*  ## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

evaluate: $(VENV)/core  ## the main job: TDE, ATDE and ARTDE beside the thesis, into runs/main (more options: ARGS=...)
	$(BIN)/artde-gym evaluate --episodes 3 --out runs/main $(ARGS)

test: check tests  ## all checks, then all tests (a selection: ARGS=...)

tests: $(VENV)/dev  ## all tests that this Python can run: without PyBullet or PyTorch, those that need none
	$(TESTS) $(ARGS)

coverage: $(VENV)/dev  ## lines and branches that the tests reach, as a table and as htmlcov/
	$(TESTS) --cov --cov-report=term:skip-covered --cov-report=html $(ARGS)

lowest: LEAST := 1000
lowest: $(VENV)-lowest/dev  ## the tests with the lowest versions that pyproject.toml allows (PyTorch: the pinned one)
	OMP_NUM_THREADS=1 $(VENV)-lowest/bin/python -m pytest -n 2 --at-least $(LEAST) -W ignore::DeprecationWarning \
		-W ignore::PendingDeprecationWarning -W ignore::FutureWarning $(ARGS)

clients: $(VENV)/core  ## train with learning libraries, in environments of their own (some: ARGS="tianshou rllib")
	$(BIN)/python scripts/clients.py $(ARGS)

check: $(VENV)/dev  ## format, lint, spelling, types and import contracts
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/codespell
	$(BIN)/basedpyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

format: $(VENV)/dev  ## format and mend what can be mended
	$(BIN)/ruff check --fix-only
	$(BIN)/ruff format

benchmark: $(VENV)/core  ## speed, as ratios in one run
	$(BIN)/artde-gym benchmark $(ARGS)

soak: $(VENV)/dev  ## hours: walks, short episodes, damaged files, random calls, kills (a part: ARGS=...)
	OMP_NUM_THREADS=1 $(BIN)/python scripts/soak.py $(ARGS)

docs: $(VENV)/docs  ## build the documentation into site/, warnings are errors (to be read in a browser, also without a server)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "artde-gym: open site/index.html"

gallery: $(VENV)/dev  ## remake the pictures of the README and of the documentation (needs chromium; some minutes)
	OMP_NUM_THREADS=1 $(BIN)/python scripts/gallery.py

viewer:  ## bundle the viewer of replays anew (needs node and npm; its sources are in scripts/viewer/src)
	cd scripts/viewer && npm ci --ignore-scripts --no-audit --no-fund && npm run --silent build

constraints: $(VENV)/core  ## pin what is not pinned yet, for every Python (everything anew: rm constraints.txt first)
	@$(PIP) uv
	touch constraints.txt
	$(BIN)/uv pip compile pyproject.toml --all-extras --universal --python-version 3.11 --no-annotate --quiet \
		--custom-compile-command 'make constraints' --output-file constraints.txt
	sed -i.old -E '/$(CUDA)/d' constraints.txt && rm constraints.txt.old

dist: $(VENV)/core  ## the wheel and the sdist into dist/, checked as an index would
	@$(PIP) build check-wheel-contents cffconvert twine
	rm -rf build dist
	$(BIN)/python -m build
	$(BIN)/twine check --strict dist/*
	$(BIN)/check-wheel-contents --toplevel artde_gym,baselines,controllers dist/*.whl
	$(BIN)/cffconvert --validate
	$(BIN)/python -c "import pathlib; wheel, = pathlib.Path('dist').glob('*.whl'); size = wheel.stat().st_size; \
		print(f'{wheel}: {size / 1e6:.2f} MB'); assert size < 1.5e6, 'a wheel is smaller than 1.5 MB'"

clean:  ## remove the environment and all caches, keep runs
	rm -rf .venv .venv-* build dist site .hypothesis .import_linter_cache .pytest_cache .ruff_cache htmlcov .coverage *.egg-info
	find artde_gym baselines controllers scripts tests -name __pycache__ -exec rm -rf {} +

$(VENV)/core: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import ensurepip, sys; sys.exit(sys.version_info[:2] < (3, 11))' 2>/dev/null || { \
		echo "artde-gym: make needs CPython 3.11 or newer with its venv module (Debian: apt install python3-venv)," >&2; \
		echo "and \`$(PYTHON)' is none. Another one: make PYTHON=/path/to/python3.13" >&2; exit 1; }
	@echo "artde-gym: installing into $(VENV)"
	@$(PYTHON) -m venv $(VENV)
	@$(INSTALL) --editable .
	@$(BIN)/python -c 'from artde_gym.sim.factory import missing_bullet as missing; \
		print("artde-gym:", missing() or "PyBullet and MuJoCo are here; PyBullet is the default")'
	@touch $@

$(VENV)/docs: $(VENV)/core
	@echo "artde-gym: installing the extra docs into $(VENV)"
	@$(INSTALL) --editable '.[docs]'
	@touch $@

$(VENV)/dev: $(VENV)/core
	@echo "artde-gym: installing the extras $(EXTRAS) into $(VENV)"
	@$(INSTALL) --editable '.[$(EXTRAS)]'
	@touch $@

$(VENV)-lowest/dev: $(VENV)/core
	@echo "artde-gym: installing the lowest versions into $(VENV)-lowest"
	@$(PIP) uv
	@$(PYTHON) -m venv $(VENV)-lowest
	@sed -nE 's/^(torch==[^ ]+).*/\1/p' constraints.txt > $(VENV)-lowest/torch.txt
	@UV_FIND_LINKS="$$PIP_FIND_LINKS" $(BIN)/uv pip compile pyproject.toml --extra test --extra docs --extra rl --extra video --extra tune --extra sweep \
		--extra scale --resolution lowest-direct --override $(VENV)-lowest/torch.txt --python $(VENV)-lowest/bin/python \
		--no-annotate --quiet --output-file $(VENV)-lowest/lowest.txt
	@sed -i.old -E '/$(CUDA)/d' $(VENV)-lowest/lowest.txt
	@UV_FIND_LINKS="$$PIP_FIND_LINKS" $(BIN)/uv pip install --quiet --python $(VENV)-lowest/bin/python --no-deps \
		--requirement $(VENV)-lowest/lowest.txt --editable .
	@touch $@
