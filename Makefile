HOST ?= 127.0.0.1
PORT ?= 8000
PYTHON ?= python3
BIN = .venv/bin

.PHONY: serve test chromium openapi clean

serve: .venv/serve  ## run the service on HOST:PORT
	@HOST=$(HOST) PORT=$(PORT) $(BIN)/python -m service

test: .venv/dev chromium  ## lint, type-check and test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest

# The viewer is tested in a real browser. Where one is missing and can be had at once, it is had;
# elsewhere those tests are skipped, and say so.
chromium:
	@for name in $$CHROMIUM chromium chromium-browser google-chrome; do \
	  command -v $$name >/dev/null && exit; \
	done; \
	if test "$$(id -u)" = 0 && grep -qs '^ID=debian' /etc/os-release; then \
	  echo "Installing chromium for the tests in a browser"; \
	  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq chromium >/dev/null && exit; \
	fi; \
	echo "There is no chromium: the tests in a browser are skipped."

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
