# Two words to start: `make report` runs the demo to reports/demo/index.html, `make test` runs the tests.
PYTHON ?= python3
CONFIG ?= config/demo.yaml
CORES ?= all
BIN := .venv/bin

.PHONY: help report sweep verify test test-all lint bench bundled-model lock clean

help:
	@echo "make report [CONFIG=config/demo.yaml] [CORES=all]  run the workflow to reports/<run>/index.html"
	@echo "make sweep  [CONFIG=...]                           figs. 7.2a and 7.2b over the sweep of the configuration"
	@echo "make verify [CONFIG=...]                           compare every file with the manifest"
	@echo "make test                                          the tests, apart from slow ones"
	@echo "make test-all                                      all tests, and again under every other Python that is installed"
	@echo "make lint                                          ruff, mypy, snakefmt, snakemake --lint"
	@echo "make bench                                         time kernels and sweep against their peers, and how time grows"
	@echo "make bundled-model                                 train the model that comes with the package (docs/models.md)"

report: .venv/report.stamp
	$(BIN)/cospeech report --config '$(CONFIG)' --cores $(CORES)

sweep: .venv/report.stamp
	$(BIN)/cospeech sweep --config '$(CONFIG)' --cores $(CORES)

verify: .venv/report.stamp
	$(BIN)/cospeech verify --config '$(CONFIG)' --cores $(CORES)

test: .venv/test.stamp
	$(BIN)/python -m pytest --numprocesses 2 --dist loadgroup -m "not slow"

test-all: test
	$(BIN)/python -m pytest --numprocesses 2 --dist loadgroup -m slow
	.ci/other_interpreters

lint: .venv/test.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/python tests/workflow/lint.py

bench: .venv/test.stamp
	$(BIN)/python bench/markov.py
	$(BIN)/python bench/hsmm.py
	$(BIN)/python bench/kinematics.py
	$(BIN)/python bench/ward.py
	$(BIN)/python bench/blending.py
	$(BIN)/python bench/pitch.py
	$(BIN)/python bench/syllables.py
	$(BIN)/python bench/lips.py
	$(BIN)/python bench/live.py
	$(BIN)/python bench/viewer.py
	$(BIN)/python bench/bodylanguage.py
	$(BIN)/python bench/sweep.py
	$(BIN)/python bench/growth.py
	$(BIN)/python bench/controller.py
	$(BIN)/python bench/capture.py
	$(BIN)/python bench/identity.py
	$(BIN)/python bench/head.py

MODEL := results/bundled/models/hsmm_sampled/clusters~8,states~3/ada
BUNDLED := src/cospeech/bundled_model

bundled-model: .venv/report.stamp
	$(BIN)/cospeech run $(MODEL) --config config/bundled.yaml --cores $(CORES)
	rm -rf $(BUNDLED)
	mkdir $(BUNDLED)
	cp $(MODEL)/model.json $(MODEL)/*.parquet $(BUNDLED)

# The environments are made from hash-locked requirements; the package itself is installed in place.
.venv/report.stamp: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "cospeech needs Python 3.11 or newer, this is %d.%d: make PYTHON=python3.12 ..." % sys.version_info[:2])'
	@PYTHONPATH=src $(PYTHON) -c 'import os, sys; from cospeech.workflow.paths import PLACEHOLDER; found = PLACEHOLDER.search(os.getcwd()); sys.exit(found and f"{os.getcwd()}: Snakemake takes {found[0]} in a path for a placeholder; rename this folder")'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	touch $@

.venv/test.stamp: .venv/report.stamp requirements-test.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements-test.lock
	touch $@

# Locks the newest versions that fit pyproject.toml, for Python 3.11 and newer (needs uv).
lock:
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --extra build --extra keywords --extra test --extra slurm pyproject.toml -o requirements-test.lock
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --extra build -c requirements-test.lock pyproject.toml -o requirements.lock

clean:
	rm -rf results reports/*/index.html reports/*/seconds.html reports/*/figures reports/*/tables
