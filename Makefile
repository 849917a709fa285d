# make repro   set up, then run the pipeline for every subject in params.yaml
# make check   set up, then the fast tests, and lint: before each commit
# make test    set up, then run the tests, all but those marked `nightly`, on as many processes as there are cores (WORKERS=1 for one)
# make nightly set up, then run all tests: what `nightly` marks shows at length what another test shows
# make view    set up, then play the asset made last in a browser (or ASSET=folder)
# make report  set up, then make a page about every subject that has scores: data/<subject>/report.html (or SUBJECT=folder)
# make lint    ruff, mypy and the layer check; prettier and eslint for the player
# make wheel   dist/*.whl: the library, the command facefolds and the web player, for use outside a checkout
# make hero    set up, then film the embedded actor at full size, run the pipeline and pack the asset: dist/hero (hours; it can be interrupted)
# make docs    set up, then make the documents a site: site/index.html (with the player on the first page after `make hero`, or after `make repro` and `make view`)
# make package dist/facefolds-player-*.tgz: the web player as an npm package, with types (nothing is published)
# make gate    set up, then run every capture that is there and hold its scores against those that are kept (hours; ONLY="actor; mugsy" for some)
# make bench   set up, then measure speed against accuracy of the trainers and draw it (hours; it can be interrupted)
# make blender an environment with Blender as a Python module, for docs/guide/engines.md (about 400 MB; needs Python 3.11)
# make charts  set up, run the pipeline, then measure what each step of the export loses, and bytes against accuracy
# make clean   remove the environment, all results, DVC's cache (experiments included) and dvc.lock

PYTHON ?= python3
VENV   ?= .venv
BLENDER_PYTHON ?= python3.11
BIN    := $(VENV)/bin
READY  := $(VENV)/.installed
PLAYER := viewer/dist/index.html

# Tests with threads of their own need two; more would wait for one another.
WORKERS ?= $(shell nproc 2>/dev/null || getconf _NPROCESSORS_ONLN)
PYTEST  := NUMBA_NUM_THREADS=2 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(WORKERS) --maxprocesses 4

.PHONY: repro check test nightly view report hero docs lint lint-player wheel package gate bench charts blender clean

repro: $(READY)
	$(BIN)/facefolds doctor
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/dvc --wait-for-lock repro
	@echo && $(BIN)/facefolds scores

check: $(READY)
	$(PYTEST) -m "not (slow or pipeline or browser or nightly)"
	@$(MAKE) --no-print-directory lint

test: $(READY)
	$(PYTEST) -m "not nightly"

nightly: $(READY)
	$(PYTEST)

view: $(READY) $(PLAYER)
	$(BIN)/facefolds view $(ASSET)

$(PLAYER): $(shell find viewer/src viewer/public -type f) viewer/package-lock.json viewer/build.mjs
	@command -v npm >/dev/null || { echo "the web player is built with Node.js 18 or newer: apt-get install nodejs npm (Debian, Ubuntu) or dnf install nodejs, then run the same command again"; exit 1; }
	cd viewer && npm ci --no-audit --no-fund --loglevel=error && npm run --silent build

report: $(READY) $(if $(shell command -v npm),$(PLAYER)) # the page shows the asset with the player
	$(BIN)/facefolds report $(SUBJECT)

hero: $(READY) $(PLAYER)
	$(BIN)/python -m docs.tools.hero

docs: $(READY)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "site/index.html"

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	@if command -v npm >/dev/null; then $(MAKE) --no-print-directory lint-player; else echo "the player was not linted: no npm (apt-get install nodejs npm)" >&2; fi

lint-player: viewer/node_modules/.package-lock.json
	npm --prefix viewer run --silent lint

viewer/node_modules/.package-lock.json: viewer/package-lock.json
	cd viewer && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

wheel: $(READY) $(PLAYER)
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .

package: $(PLAYER)
	mkdir -p dist
	cd viewer && npm pack --silent --pack-destination ../dist

gate: $(READY)
	$(BIN)/python -m bench.gate $(or $(GATE),.gate) $(if $(ONLY),--only "$(ONLY)")

bench: $(READY)
	$(BIN)/python -m bench.speed_accuracy

charts: repro
	$(BIN)/python -m bench.sweeps queue rate
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/dvc exp run --run-all
	$(BIN)/python -m bench.sweeps collect
	$(BIN)/python -m bench.sweeps draw

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else f"facefolds needs Python 3.11 or newer, found {sys.version.split()[0]}: install one and run make PYTHON=python3.11 ...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	$(BIN)/facefolds doctor
	$(BIN)/python -c 'import pymatting' # it compiles itself when it is first imported
	@touch $(READY)

blender: .venv-blender/.installed

.venv-blender/.installed: engines/blender/requirements.txt
	@command -v $(BLENDER_PYTHON) >/dev/null || { echo "bpy needs Python 3.11: install it, or give make blender BLENDER_PYTHON=..."; exit 1; }
	$(BLENDER_PYTHON) -m venv .venv-blender
	.venv-blender/bin/python -m pip install --quiet --requirement engines/blender/requirements.txt
	@touch $@

clean:
	rm -rf site $(VENV) .venv-blender bench/browser/node_modules viewer/node_modules viewer/dist .dvc/tmp .dvc/cache data/*/ data/.code data/.config data/.timings data/.locks dvc.lock
