from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import anyio
import pytest
from prometheus_client import CollectorRegistry

from service.api.admission import Admission
from service.api.context import Context
from service.api.metrics import Metrics
from service.api.mirror import Mirror
from service.api.readiness import Readiness
from service.api.workers import Workers
from service.encode.installed import Installed
from service.errors import ModelFault
from service.inferences import Inferences
from service.jobs.jobs import Jobs
from service.jobs.store import Bounds, JobStore
from service.requests import Upload
from service.store.meshstore import MeshStore, open_store

FAULT = ModelFault("model_digest", "stool.onnx is another", "Install it again.")


def model(version: str) -> Any:
    return SimpleNamespace(name="stool", version=version, digest=f"sha256-{version}")


class Looks:
    """What the models folder has at each look."""

    def __init__(self, *found: Installed | Exception) -> None:
        self._found = iter(found)

    def __call__(self) -> Installed:
        found = next(self._found)
        if isinstance(found, Exception):
            raise found
        return found


@pytest.fixture
def store(tmp_path: Path) -> MeshStore:
    return open_store(10_000, tmp_path / "store", 1_000_000, None)


def mirrored(store: MeshStore, *looks: Installed | Exception) -> tuple[Context, CollectorRegistry]:
    """A context whose models have been looked for so often, and what is seen of it."""
    workers = Workers(2)
    readiness = Readiness(Looks(*looks))
    admission = Admission(workers, 3, 1000)
    job_store = JobStore(None, Bounds(10, 1000, 60.0))
    runner: Any = SimpleNamespace(made={("edit", "ok"): 3}, ended={("edit", "succeeded"): 1})
    jobs = Jobs(job_store, runner)
    context = Context(store, Inferences(1000), readiness, workers, admission, Metrics(), jobs)
    registry = CollectorRegistry()
    registry.register(Mirror(context))

    async def look() -> None:
        for number in range(len(looks)):
            await (readiness.reload() if number else readiness.start())

    anyio.run(look)
    return context, registry


def value(registry: CollectorRegistry, name: str, **labels: str) -> float | None:
    return registry.get_sample_value(f"shape_parameters_{name}", labels)


def test_models_are_told_with_their_versions(store: MeshStore) -> None:
    found = Installed.of([model("1.0.0")], [model("2.0.0")], {}, [FAULT])
    _, registry = mirrored(store, found)
    for version, default in (("1.0.0", "false"), ("2.0.0", "true")):
        labels = {"version": version, "digest": f"sha256-{version}", "default": default}
        assert value(registry, "model_info", category="stool", **labels) == 1
    assert value(registry, "faulty_models") == 1
    assert value(registry, "ready") == 1


def test_what_is_not_ready_says_so(store: MeshStore) -> None:
    context, registry = mirrored(store)
    assert value(registry, "ready") == 0
    context, registry = mirrored(store, FAULT)
    assert value(registry, "ready") == 0
    context, registry = mirrored(store, Installed.of([model("1")], [], {}))
    assert (value(registry, "ready"), value(registry, "draining")) == (1, 0)
    context.readiness.drain()
    assert (value(registry, "ready"), value(registry, "draining")) == (0, 1)


def test_reloads_are_told_by_how_they_went(store: MeshStore) -> None:
    good = Installed.of([model("1")], [], {})
    _, registry = mirrored(store, good, FAULT, RuntimeError("bad"), good)
    assert value(registry, "model_reloads_total", result="failure") == 2
    assert value(registry, "model_reloads_total", result="success") == 1


def test_the_store_is_told_by_tier(store: MeshStore) -> None:
    _, registry = mirrored(store)
    upload = Upload(b"x" * 5000, "a.obj", None)
    store.put(upload)
    store.get(upload.mesh_id)
    for tier in ("memory", "disk"):
        assert value(registry, "store_meshes", tier=tier) == 1
        taken = value(registry, "store_bytes", tier=tier)
        limit = value(registry, "store_limit_bytes", tier=tier)
        assert taken is not None
        assert limit is not None
        assert 5000 < taken < limit
    assert value(registry, "store_hits_total", tier="memory") == 1
    store.put(Upload(b"y" * 5000, "b.obj", None))
    assert value(registry, "store_evictions_total", tier="memory") == 1
    store.get(upload.mesh_id)
    assert value(registry, "store_misses_total", tier="memory") == 1
    assert value(registry, "store_hits_total", tier="disk") == 1
    assert value(registry, "store_failures_total", tier="disk", kind="corrupted") == 0


def test_places_are_told(store: MeshStore) -> None:
    context, registry = mirrored(store)
    for _ in range(2):
        context.admission.enter(300)
    assert value(registry, "admission_places") == 5
    assert value(registry, "admitted_requests") == 2
    assert value(registry, "pending_bytes") == 600
    assert value(registry, "pending_limit_bytes") == 1000
    with pytest.raises(Exception, match="1000 bytes"):
        context.admission.enter(500_000)
    assert value(registry, "admission_rejections_total", reason="bytes") == 1
    assert value(registry, "admission_rejections_total", reason="places") == 0
