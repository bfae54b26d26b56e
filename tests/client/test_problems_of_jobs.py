"""Variants of a mesh, and the jobs that make them: asked for wrongly, too early, too late."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from provoke import BOX, client_of, provokes, refused

from service.api import events
from service.augment import variants
from service.augment.validity import Limits
from service.client import Mesh, ShapeClient
from service.client.errors import problem
from service.client.models import Fault
from service.jobs import runner
from service.main import create_app
from service.settings import Settings

WIDER = [{"width": {"scale": 1.2}}, {"width": {"scale": 1.4}}]


@pytest.fixture(scope="module")
def client(serving: Any) -> Iterator[ShapeClient]:
    """A client of a service that knows boxes alone."""
    with serving(create_app(Settings(categories=("debug",), workers=1))) as http:
        yield client_of(http)


@pytest.fixture
def bounded(serve: Any) -> Callable[..., ShapeClient]:
    """Makes such a service with some settings."""
    return lambda **settings: client_of(
        serve(create_app(Settings(categories=("debug",), workers=1, **settings)))
    )


@contextmanager
def held() -> Iterator[None]:
    """No job begins to make its variants meanwhile."""
    release, making = threading.Event(), runner.making

    def later(*arguments: Any) -> Any:
        assert release.wait(20)
        return making(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "making", later)
        try:
            yield
        finally:
            release.set()


VARIANTS = {
    "variants_not_json": {"variants": "["},
    "variants_malformed": {"variants": "[]"},
    "variants_too_many": {"variants": "[" + "{}," * 1000 + "{}]"},
    "variants_exclusive": {"variants": "[{}]", "edits": "{}"},
}


@provokes(**dict.fromkeys(VARIANTS, 422))
def test_a_list_of_variants(client: ShapeClient, code: str) -> Any:
    return refused(lambda: client.post("/edit", fields=VARIANTS[code], files={"mesh": BOX}))


@provokes(variants_too_large=413)
def test_more_than_is_held_at_once(bounded: Any) -> Any:
    client = bounded(max_pending_bytes=1000)
    return refused(lambda: client.edit_variants(BOX, WIDER))


@provokes(variant_damaged=200)
def test_a_mesh_that_no_draw_leaves_whole(
    client: ShapeClient, monkeypatch: pytest.MonkeyPatch
) -> Any:
    """Here because none is whole enough: what is drawn leaves a box as it should be."""
    strict = partial(variants.Source, limits=Limits(flips=-1.0))
    monkeypatch.setattr(variants, "Source", strict)
    (row,) = client.augment(BOX, count=1).manifest
    return Fault(**row["problem"])


@provokes(job_unknown=404)
def test_a_job_that_there_is_not(client: ShapeClient) -> Any:
    return refused(lambda: client.job("job-" + "x" * 22))


@provokes(job_not_finished=409, job_cancelled=409)
def test_a_job_without_a_result(client: ShapeClient, code: str) -> Any:
    with held():
        job = client.submit_edit(BOX, WIDER)
        if code == "job_cancelled":
            client.cancel(job)
        refusal = refused(lambda: client.result(job))
        client.cancel(job)
    assert (refusal.retry_after is None) == (code == "job_cancelled")
    return refusal


@provokes(job_failed=409)
def test_a_job_of_a_mesh_that_is_none(client: ShapeClient) -> Any:
    job = client.wait(client.submit_edit(Mesh(b"v 0 0 0", "a.obj"), WIDER), timeout=20)
    told = problem(job.problem, 422)
    assert told is not None
    assert told.code == "empty_mesh"
    return refused(lambda: client.result(job))


@provokes(job_interrupted=503)
def test_a_job_that_the_service_always_ends_amid(
    client: ShapeClient, monkeypatch: pytest.MonkeyPatch
) -> Any:
    monkeypatch.setattr(runner, "ATTEMPTS", 0)
    job = client.wait(client.submit_edit(BOX, WIDER), timeout=20)
    assert job.status == "failed"
    return problem(job.problem, 503)


@provokes(idempotency_conflict=409)
def test_a_key_of_another_request(client: ShapeClient) -> Any:
    client.submit_edit(BOX, WIDER, idempotency_key="one")
    return refused(lambda: client.submit_edit(BOX, WIDER[:1], idempotency_key="one"))


@provokes(jobs_full=429)
def test_more_jobs_than_may_wait(bounded: Any) -> Any:
    client = bounded(jobs=1)
    with held():
        client.submit_edit(BOX, WIDER)
        refusal = refused(lambda: client.submit_edit(BOX, WIDER))
    assert refusal.retry_after
    return refusal


@provokes(job_too_large=413)
def test_a_job_larger_than_all_may_be(bounded: Any) -> Any:
    return refused(lambda: bounded(jobs_bytes=1000).submit_edit(BOX, WIDER))


@provokes(jobs_unavailable=503)
def test_a_database_that_is_none(bounded: Any, tmp_path: Path) -> Any:
    (tmp_path / "jobs.sqlite").write_bytes(b"no database" * 100)
    return refused(lambda: bounded(jobs_dir=tmp_path).submit_edit(BOX, WIDER))


@provokes(streams_full=429)
def test_more_who_follow_than_may(client: ShapeClient, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(events, "STREAMS", 0)
    job = client.submit_edit(BOX, WIDER)
    return refused(lambda: list(client.events(job)))
