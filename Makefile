HOST ?= 127.0.0.1
PORT ?= 8000
JOBS_DIR ?= .jobs
PYTHON ?= python3
BIN = .venv/bin

ENGINE ?= docker
IMAGE ?= shape-parameters
BASE_IMAGE ?= python:3.11-slim-bookworm

.PHONY: serve test test-ray chromium openapi lock image image-test clean

# Jobs of one's own machine outlive a restart; elsewhere nothing is written unless it is asked for.
serve: .venv/serve  ## run the service on HOST:PORT
	@HOST=$(HOST) PORT=$(PORT) JOBS_DIR=$(JOBS_DIR) $(BIN)/python -m service

test: .venv/dev chromium  ## lint, type-check and test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest -n 2 --dist loadfile

# Ray is large, and what it does is tested apart, in an environment of its own.
test-ray: .venv-ray/batch  ## test augmentation on a Ray cluster of this machine
	.venv-ray/bin/pytest tests/ray

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

LOCK = uv pip compile --quiet --upgrade --generate-hashes --python-version 3.11 \
  --python-platform linux --custom-compile-command "make lock"

lock:  ## pin anew what the image is made from; needs uv
	$(LOCK) pyproject.toml --extra otel --extra shared -o docker/requirements.lock
	$(LOCK) docker/build.in -o docker/build.lock

# Podman's own format has no health checks.
image:  ## build the image with ENGINE, docker or podman
	BUILDAH_FORMAT=docker $(ENGINE) build -f docker/Dockerfile -t $(IMAGE) \
	  --build-arg BASE_IMAGE=$(BASE_IMAGE) --build-arg REVISION=$$(git rev-parse HEAD) \
	  --build-arg VERSION=$$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml) .

image-test: .venv/dev  ## build the image, run it confined, and try it; minutes
	$(BIN)/python tests/docker/run.py --engine $(ENGINE) --base $(BASE_IMAGE)

clean:  ## remove the environments
	rm -rf .venv .venv-ray

# The environment is made once for each set of dependencies.
.venv/serve: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -e .
	@touch $@

.venv/dev: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[train,dev]'
	@touch $@ .venv/serve

.venv-ray/batch: pyproject.toml
	test -x .venv-ray/bin/python || $(PYTHON) -m venv .venv-ray
	.venv-ray/bin/pip install --quiet --disable-pip-version-check -e '.[batch,dev]' 'onnx>=1.19,<2'
	@touch $@
