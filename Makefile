HOST ?= 127.0.0.1
PORT ?= 8000
PYTHON ?= python3
BIN = .venv/bin

.PHONY: serve test openapi clean

serve: .venv/serve  ## run the service on HOST:PORT
	@HOST=$(HOST) PORT=$(PORT) $(BIN)/python -m service

test: .venv/dev  ## lint, type-check and test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest

openapi: .venv/serve  ## write openapi.yaml anew
	$(BIN)/python -m service.api.openapi > openapi.yaml

clean:  ## remove the environment
	rm -rf .venv

# The environment is made once for each set of dependencies.
.venv/serve: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -e .
	@touch $@

.venv/dev: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[train,dev]'
	@touch $@ .venv/serve
