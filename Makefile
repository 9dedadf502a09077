# Two commands do everything: `make demo` and `make test`. Both set up .venv first.

PYTHON ?= python3
SECONDS ?= 30
TIMES ?= 30
DAMAGES ?= 10000
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: setup docs demo faults damage mutants soak test test-slow test-lowest check validate bench-setup proto lock clean bench

setup: $(READY)

$(READY): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "pneuarm needs Python 3.11 or newer; name one: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation \
	    --editable distributions/client --editable .
	@touch $(READY)

demo: setup
	@$(BIN)/pneuarm demo --seconds $(SECONDS)

# Every fault that docs/safety.md names, TIMES times at random moments; writes its table there.
faults: setup
	$(BIN)/python -m tools.faults --times $(TIMES) --write docs/safety.md

# Every small mistake in the modules that safety rests on, one at a time: does a test notice it?
# MODULES="hardware/guard.py ..." tries these alone; writes its table into docs/safety.md.
mutants: setup
	$(BIN)/python -m tools.mutants $(MODULES) --write docs/safety.md

# Logs of several kinds, damaged at random; says what was lost, or that nothing was.
damage: setup
	$(BIN)/python -m tools.logs.damage --times $(DAMAGES)

# A daemon for an hour beside a busy process: what grows, and is a tick lost?
MINUTES ?= 60
soak: setup
	$(BIN)/python -m tools.soak --minutes $(MINUTES)

# Two workers: processes that need their time on one, everything else on the other.
test: check
	$(BIN)/pytest -n 2 --dist loadgroup -m "not slow"

# What takes longest: calibrations, the demo, ends under stress, devices behind the daemon.
test-slow: setup
	$(BIN)/pytest -m slow

# Style, types, import contracts; what the client's distribution holds also as Python 3.10 sees it.
CLIENT := pneuarm/__init__.py pneuarm/__main__.py \
    $(addprefix pneuarm/, controllers/arm/errors.py controllers/arm/names.py logs/schema service/client service/network)
check: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --python-version 3.10 --follow-imports silent $(CLIENT)
	$(BIN)/lint-imports

# Everything behind docs/validation.md: figures, workspace, table 1, gravity, models, pictures.
# The finite elements are recorded; `python -m tools.validation.finite_elements` solves them anew.
validate: bench-setup
	$(BIN)/python -m tools.validation.report --out docs

# Every benchmark, one after another, on a machine that does nothing else; writes its table.
bench: bench-setup
	$(BIN)/python -m tools.bench.report --write docs/benchmarks.md

# The peers that the benchmarks compare with; nothing else needs them.
bench-setup: setup
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-bench.lock

# The tables of docs/ that stand in the code: keys, messages, configuration, faults, modes, rooms.
docs: setup
	$(BIN)/python -m tools.docs

# Message classes run with their protoc's protobuf or a newer one: 5.29 is what the oldest
# environments have that the client shall share, and what foxglove-schemas-protobuf was made with.
# This protoc wants a protobuf older than the daemon's, so it stands in an environment of its own.
proto:
	$(PYTHON) -m venv .venv-proto
	.venv-proto/bin/pip install --quiet --disable-pip-version-check grpcio-tools==1.71.2
	.venv-proto/bin/python -m grpc_tools.protoc -I. --python_out=. --pyi_out=. \
	    pneuarm/logs/schema/pneuarm.proto

# Needs uv; only for whoever changes the dependencies.
LOCK := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
    --no-emit-index-url --no-annotate --no-header --extra mujoco --extra pictures --group dev --no-emit-package pneuarm-client
lock:
	$(LOCK) --output-file requirements.lock
	$(LOCK) --group bench --constraint requirements.lock --output-file requirements-bench.lock

# The oldest versions that pyproject.toml allows, as uv finds them, pass the tests too.
LOWEST := .venv-lowest
test-lowest:
	uv venv --quiet --clear --seed --python $(PYTHON) $(LOWEST)
	uv pip install --quiet --python $(LOWEST) --resolution lowest-direct \
	    --requirements pyproject.toml --extra mujoco --extra pictures --group dev --editable .
	$(LOWEST)/bin/pytest -n 2 --dist loadgroup -m "not slow"
	uv pip compile --quiet --resolution lowest-direct --python $(LOWEST) distributions/client/pyproject.toml \
	    --output-file $(LOWEST)/client.txt
	uv pip install --quiet --python $(LOWEST) --target $(LOWEST)/client --requirements $(LOWEST)/client.txt
	CLIENT_PACKAGES=$(CURDIR)/$(LOWEST)/client $(LOWEST)/bin/pytest tests/packaging/test_installed.py -k client

clean:
	rm -rf $(VENV) .venv-* build *.egg-info distributions/client/*.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
