"""Jobs of the service itself, through both clients."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import Any

import httpx
import pytest
from provoke import BOX

from service.client import (
    AsyncShapeClient,
    IdempotencyConflict,
    Job,
    JobCancelled,
    JobFailed,
    JobNotFinished,
    JobUnknown,
    Mesh,
    ShapeClient,
    TimedOut,
    scale,
)
from service.jobs import making
from service.main import create_app
from service.settings import Settings

WIDER = [{"width": scale(1.2)}, {"width": scale(1.4)}]
NO_MESH = Mesh(b"v 0 0 0", "point.obj")


@pytest.fixture(scope="module")
def http(serving: Any) -> Iterator[httpx.Client]:
    """A client of a service that knows boxes alone, and keeps its jobs in memory."""
    with serving(create_app(Settings(categories=("debug",), workers=1))) as http:
        yield http


@pytest.fixture
def client(http: httpx.Client) -> ShapeClient:
    return ShapeClient(http=http)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Semaphore]:
    """A variant of a job is made for each release; all are at the end."""
    gate, part = threading.Semaphore(0), making._Edits.part

    def later(self: Any, index: int) -> Any:
        assert gate.acquire(timeout=20)
        return part(self, index)

    monkeypatch.setattr(making._Edits, "part", later)
    yield gate
    gate.release(1000)


@asynccontextmanager
async def awaiting(http: httpx.Client) -> AsyncIterator[AsyncShapeClient]:
    async with AsyncShapeClient(str(http.base_url)) as client:
        yield client


def test_a_result_is_what_the_call_answers(client: ShapeClient, tmp_path: Any) -> None:
    job = client.submit_edit(BOX, WIDER)
    assert (job.kind, job.progress.total, job.durable) == ("edit", 2, False)
    ended = client.wait(job, timeout=20)
    assert (ended.status, ended.progress.done) == ("succeeded", 2)
    assert ended.started
    assert ended.finished
    result = client.result(ended, to=tmp_path / "variants.zip")
    assert result.data == client.edit_variants(BOX, WIDER).data


def test_a_result_of_draws_is_what_the_call_answers(client: ShapeClient) -> None:
    job = client.submit_augment(BOX, count=2, seed=5)
    assert (job.kind, job.progress.total) == ("augment", 2)
    result = client.result(client.wait(job.id, timeout=20))
    assert result.data == client.augment(BOX, count=2, seed=5).data


def test_each_change_is_told(client: ShapeClient, gate: threading.Semaphore) -> None:
    told: list[Job] = []

    def on_progress(job: Job) -> None:
        told.append(job)
        gate.release()

    assert client.wait(client.submit_edit(BOX, WIDER), on_progress, timeout=20) == told[-1]
    assert [job.progress.done for job in told] == sorted(job.progress.done for job in told)
    assert [job.status for job in told][-1] == "succeeded"
    assert "running" in {job.status for job in told}


def test_events_have_ids_to_go_on_from(client: ShapeClient) -> None:
    job = client.submit_edit(BOX, WIDER)
    events = list(client.events(job, timeout=20))
    versions = [int(event.id or 0) for event in events]
    assert versions == sorted(set(versions))
    assert versions[0] > 0
    (last,) = client.events(job, last_event_id=str(versions[-1] - 1))
    assert last == events[-1]
    # Nothing is left to be told: the service says so, and is asked for the job.
    (again,) = client.events(job, last_event_id=events[-1].id)
    assert (again.id, again.job) == (None, last.job)


def test_there_is_no_result_before_the_end(client: ShapeClient, gate: threading.Semaphore) -> None:
    job = client.submit_edit(BOX, WIDER)
    with pytest.raises(JobNotFinished) as caught:
        client.result(job)
    assert caught.value.retry_after
    with pytest.raises(TimedOut, match=f"/jobs/{job.id} is not finished after 0.3 s"):
        client.wait(job, timeout=0.3)
    assert not client.job(job).is_finished
    cancelled = client.cancel(job)
    assert cancelled is not None
    assert cancelled.status == "cancelled"
    with pytest.raises(JobCancelled):
        client.result(job)
    assert client.wait(job).status == "cancelled"


def test_a_failed_job_says_why(client: ShapeClient) -> None:
    ended = client.wait(client.submit_augment(NO_MESH), timeout=20)
    assert ended.status == "failed"
    assert ended.problem is not None
    assert ended.problem["code"] == "empty_mesh"
    with pytest.raises(JobFailed):
        client.result(ended)


def test_jobs_are_listed_until_they_are_removed(client: ShapeClient) -> None:
    older, newer = client.submit_edit(BOX, WIDER), client.submit_augment(BOX, count=1)
    ids = [job.id for job in client.jobs()]
    assert ids.index(newer.id) < ids.index(older.id)
    assert client.cancel(client.wait(older, timeout=20)) is None
    assert older.id not in [job.id for job in client.jobs()]
    with pytest.raises(JobUnknown):
        client.job(older)
    with pytest.raises(JobUnknown):
        client.wait(older)


def test_a_key_makes_one_job(client: ShapeClient) -> None:
    first = client.submit_augment(BOX, count=1, idempotency_key="mine")
    assert client.submit_augment(BOX, count=1, idempotency_key="mine").id == first.id
    assert client.submit_augment(BOX, count=1).id != first.id
    with pytest.raises(IdempotencyConflict):
        client.submit_augment(BOX, count=2, idempotency_key="mine")


def test_a_job_names_a_mesh_that_is_kept(client: ShapeClient) -> None:
    mesh = Mesh(BOX, "box.glb")
    client.infer(mesh)
    sent: list[int] = []
    job = client.submit_edit(mesh, WIDER, progress=lambda done, _: sent.append(done))
    assert sent[-1] < len(BOX)
    assert client.result(client.wait(job, timeout=20)).manifest[1]["status"] == "ok"


def test_all_of_it_awaits(http: httpx.Client) -> None:
    async def course() -> None:
        async with awaiting(http) as client:
            job = await client.submit_edit(BOX, WIDER)
            told: list[Job] = []
            ended = await client.wait(job, told.append, timeout=20)
            assert told[-1] == ended == await client.job(job)
            assert ended.status == "succeeded"
            result = await client.result(ended)
            assert result.data == (await client.edit_variants(BOX, WIDER)).data
            drawn = await client.submit_augment(BOX, count=2)
            events = [event async for event in client.events(drawn, timeout=20)]
            assert events[-1].job.status == "succeeded"
            assert (await client.result(drawn)).data == (await client.augment(BOX, count=2)).data
            assert {job.id, drawn.id} <= {listed.id for listed in await client.jobs()}
            assert await client.cancel(job) is None
            with pytest.raises(JobUnknown):
                await client.wait(job)

    asyncio.run(course())


def test_many_wait_at_the_same_time(http: httpx.Client) -> None:
    async def course() -> list[str]:
        async with awaiting(http) as client:
            jobs = [await client.submit_augment(BOX, count=1, seed=seed) for seed in range(5)]
            ended = await asyncio.gather(*(client.wait(job, timeout=20) for job in jobs))
            return [job.status for job in ended]

    assert asyncio.run(course()) == ["succeeded"] * 5


def test_cancelling_awaits(http: httpx.Client, gate: threading.Semaphore) -> None:
    async def course() -> None:
        async with awaiting(http) as client:
            job = await client.submit_edit(BOX, WIDER)
            waiting = asyncio.create_task(client.wait(job, timeout=20))
            await asyncio.sleep(0.1)
            cancelled = await client.cancel(job)
            assert cancelled is not None
            assert (await waiting).status == "cancelled"

    asyncio.run(course())
