from __future__ import annotations

import httpx
import pytest
from client_app import Script, job, refused, stream

from service.client import Job, JobFailed, TimedOut


def test_a_job_has_one_key_however_often_it_is_submitted() -> None:
    script = Script(httpx.ReadError("dropped"), httpx.Response(202, json=job("queued")))
    submitted = script.client().submit_edit(b"solid", [{"seat_width": 0.5}])
    assert submitted.status == "queued"
    first, second = script.requests
    assert first.headers["idempotency-key"] == second.headers["idempotency-key"]
    assert first.headers["prefer"] == "respond-async"
    assert b'[{"seat_width": 0.5}]' in first.content


def test_events_go_on_where_they_broke_off() -> None:
    script = Script(
        stream((1, job("queued")), (2, job("running", 1))),
        stream(),
        httpx.Response(200, json=job("running", 1), headers={"retry-after": "2"}),
        stream((3, job("succeeded", 2))),
    )
    told: list[Job] = []
    ended = script.client().wait("job-1", told.append)
    assert ended.is_finished
    assert [j.progress.done for j in told] == [0, 1, 2]
    assert script.requests[-1].headers["last-event-id"] == "2"
    assert script.slept == [2.0]


def test_without_events_the_service_is_asked() -> None:
    script = Script(
        refused(404, "not_found"),
        httpx.Response(200, json=job("running", 1), headers={"retry-after": "7"}),
        httpx.Response(200, json=job("failed", 1)),
    )
    assert script.client().wait("job-1").status == "failed"
    assert script.slept == [7.0]


def test_waiting_ends_in_time() -> None:
    asked = [httpx.Response(200, json=job("running"), headers={"retry-after": "4"})] * 9
    script = Script(refused(404, "not_found"), *asked)
    with pytest.raises(TimedOut, match="not finished after 10 s"):
        script.client().wait("job-1", timeout=10)
    assert script.slept == [4.0, 4.0, 2.0]


def test_a_failed_job_has_no_result() -> None:
    with pytest.raises(JobFailed, match=r"job_failed: It is so\. \(Do else\.\) \[4b\]"):
        Script(refused(409, "job_failed")).client().result("job-1")


def test_cancelling() -> None:
    script = Script(httpx.Response(200, json=job("cancelled")), httpx.Response(204))
    client = script.client()
    cancelled = client.cancel("job-1")
    assert cancelled is not None
    assert cancelled.status == "cancelled"
    assert client.cancel("job-1") is None
