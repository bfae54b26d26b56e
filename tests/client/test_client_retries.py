from __future__ import annotations

from datetime import UTC, datetime

import httpx
import pytest
from client_app import Script, alive, refused

from service.client import (
    AnswerMalformed,
    ConnectionFailed,
    NotFound,
    ServerFault,
    TimedOut,
    TooManyRequests,
    Unavailable,
)


def test_waits_as_long_as_the_service_says() -> None:
    script = Script(refused(429, "overloaded", retry_after="3"), alive())
    assert script.client().alive().status == "alive"
    assert script.slept == [3.125]


def test_a_date_is_honoured() -> None:
    date = "Thu, 01 Jan 2026 00:00:05 GMT"
    script = Script(refused(503, "starting", retry_after=date), alive())
    script.client(now=lambda: datetime(2026, 1, 1, tzinfo=UTC)).alive()
    assert script.slept == [5.125]


@pytest.mark.parametrize(
    "fault",
    [
        httpx.ConnectError("refused"),
        httpx.ReadTimeout("slow"),
        httpx.RemoteProtocolError("dropped"),
        httpx.Response(502, text="<html>Bad Gateway</html>"),
    ],
)
def test_what_passes_is_tried_again_with_growing_jitter(fault: httpx.Response | Exception) -> None:
    script = Script(fault, httpx.ConnectError("refused"), alive())
    script.client(base_s=1.0).alive()
    assert script.slept == [0.5, 1.0]


@pytest.mark.parametrize(
    ("answer", "kind"),
    [
        (refused(404, "not_found", retry_after="1"), NotFound),
        (refused(500, "internal_error", retry_after="1"), ServerFault),
        (refused(503, "model_digest"), Unavailable),
        (httpx.Response(200, text="<html>"), AnswerMalformed),
        (httpx.Response(307, headers={"location": "http://elsewhere.test"}), AnswerMalformed),
    ],
)
def test_what_stays_is_not(answer: httpx.Response, kind: type[Exception]) -> None:
    script = Script(answer)
    with pytest.raises(kind):
        script.client().alive()
    assert len(script.requests) == 1


def test_attempts_are_bounded() -> None:
    script = Script(*[httpx.ConnectError("refused")] * 3)
    with pytest.raises(ConnectionFailed, match=r"GET http://shapes\.test/livez: refused"):
        script.client(attempts=3).alive()
    assert len(script.slept) == 2


def test_time_is_bounded() -> None:
    script = Script(refused(429, "jobs_full", retry_after="61"))
    with pytest.raises(TooManyRequests):
        script.client().alive()
    assert script.slept == []


def test_none_are_made_when_none_are_wanted() -> None:
    script = Script(httpx.ReadTimeout("slow"))
    with pytest.raises(TimedOut):
        script.client(attempts=1).alive()
