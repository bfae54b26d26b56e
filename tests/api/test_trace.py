from __future__ import annotations

import logging
import re
from typing import Any

import httpx
import pytest

from service.api.trace import trace_id

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = "00f067aa0ba902b7"


@pytest.mark.parametrize(
    "traceparent",
    [f"00-{TRACE}-{PARENT}-01", f" 00-{TRACE}-{PARENT}-00 ", f"01-{TRACE}-{PARENT}-01-more"],
)
def test_a_valid_traceparent_gives_the_id(traceparent: str) -> None:
    assert trace_id(traceparent) == TRACE


@pytest.mark.parametrize(
    "traceparent",
    [
        None,
        "",
        TRACE,
        f"00-{TRACE.upper()}-{PARENT}-01",
        f"00-{'0' * 32}-{PARENT}-01",
        f"00-{TRACE}-{'0' * 16}-01",
        f"00-{TRACE}-{PARENT}-01-more",
        f"ff-{TRACE}-{PARENT}-01",
        f"00-{TRACE}-{PARENT}",
        f"00-{TRACE}\r\nX: y-{PARENT}-01",
    ],
)
def test_an_invalid_one_gives_a_fresh_id(traceparent: str | None) -> None:
    first, second = trace_id(traceparent), trace_id(traceparent)
    assert re.fullmatch("[0-9a-f]{32}", first)
    assert first != second
    assert first != TRACE


def test_every_answer_names_its_trace(client: httpx.Client) -> None:
    headers = {"traceparent": f"00-{TRACE}-{PARENT}-01"}
    for path in ("/livez", "/readyz", "/nowhere", "/openapi.json"):
        assert client.get(path, headers=headers).headers["trace-id"] == TRACE


def test_an_unforeseen_error_is_logged_with_its_trace_and_tells_nothing(
    client: httpx.Client, pretend: Any, problem: Any, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> None:
        raise RuntimeError("a secret of the inside")

    pretend.work = fail
    with caplog.at_level(logging.ERROR, "service"):
        response = client.post("/infer", files={"mesh": ("a.obj", b"abc")})
    document = problem(response, 500, "internal_error")
    assert "secret" not in response.text
    assert document.trace_id in caplog.text
    assert "a secret of the inside" in caplog.text

    pretend.work = lambda: None
    assert client.post("/infer", files={"mesh": ("a.obj", b"abc")}).status_code == 200
