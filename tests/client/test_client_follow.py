"""How a job is followed where connections break and events are missing: scripted answers."""

from __future__ import annotations

import httpx
import pytest
from client_app import Script, job, refused, stream

from service.client import (
    AnswerMalformed,
    ConnectionFailed,
    Job,
    JobUnknown,
    TimedOut,
    TooManyRequests,
)


def asked(status: str, done: int = 0, retry_after: str = "2") -> httpx.Response:
    return httpx.Response(200, json=job(status, done), headers={"retry-after": retry_after})


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
        asked("running", 1),
        stream((3, job("succeeded", 2))),
    )
    told: list[Job] = []
    ended = script.client().wait("job-1", told.append)
    assert ended.is_finished
    assert [j.progress.done for j in told] == [0, 1, 2]
    assert [r.headers.get("last-event-id") for r in script.requests] == [None, "2", None, "2"]
    assert script.slept == [1.0, 2.0]


def test_it_comes_again_when_the_service_says() -> None:
    script = Script(
        stream((1, job("running")), begins="retry: 3000\n\n"),
        httpx.ReadError("dropped"),
        stream((2, job("succeeded"))),
    )
    script.client().wait("job-1")
    assert script.slept == [3.0, 3.0]


def test_what_is_told_twice_is_told_once() -> None:
    script = Script(
        stream(), asked("running", 1), stream((4, job("running", 1)), (5, job("failed", 1)))
    )
    assert [event.id for event in script.client().events("job-1")] == [None, "5"]


def test_events_of_other_kinds_are_passed_over() -> None:
    begins = "id: 1\nevent: news\ndata: of another kind\n\n"
    script = Script(stream((2, job("succeeded")), begins=begins))
    assert [event.id for event in script.client().events("job-1")] == ["2"]


@pytest.mark.parametrize(
    "answer",
    [refused(404, "not_found"), httpx.Response(204), httpx.Response(200, json={"some": "page"})],
)
def test_without_events_the_service_is_asked(answer: httpx.Response) -> None:
    script = Script(answer, asked("running", 1, "7"), asked("failed", 1))
    assert script.client().wait("job-1").status == "failed"
    assert script.slept == [7.0]


def test_where_too_many_are_told_the_service_is_asked_meanwhile() -> None:
    full = refused(429, "streams_full", retry_after="1")
    script = Script(*[full, asked("running", 1)] * 9, stream((2, job("succeeded", 2))))
    told = [event.job.progress.done for event in script.client().events("job-1")]
    assert told == [1, 2]
    with pytest.raises(TooManyRequests):
        Script(full).client(attempts=1).wait("job-1")


def test_a_job_that_is_removed_is_followed_no_more() -> None:
    script = Script(stream((1, job("running"))), refused(404, "job_unknown"))
    with pytest.raises(JobUnknown):
        script.client().wait("job-1")


def test_an_event_that_is_no_job_is_malformed() -> None:
    with pytest.raises(AnswerMalformed, match="an event that is no job"):
        Script(stream((1, {"id": 3}))).client().wait("job-1")


def test_what_does_not_pass_is_not_waited_out() -> None:
    script = Script(*[httpx.ConnectError("refused")] * 3)
    with pytest.raises(ConnectionFailed):
        script.client(attempts=3).wait("job-1")
    assert len(script.slept) == 2


def test_waiting_ends_in_time() -> None:
    script = Script(refused(404, "not_found"), *[asked("running", 0, "4")] * 9)
    with pytest.raises(TimedOut, match="not finished after 10 s"):
        script.client().wait("job-1", timeout=10)
    assert script.slept == [4.0, 4.0, 2.0]


def test_a_busy_service_is_not_asked_for_longer_than_there_is_time() -> None:
    busy = refused(429, "overloaded", retry_after="20")
    script = Script(refused(404, "not_found"), busy)
    with pytest.raises(TooManyRequests):
        script.client().wait("job-1", timeout=10)
    assert script.slept == []
