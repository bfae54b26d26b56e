from __future__ import annotations

import json
import logging
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from wire import connected, head, reply, until

LIMIT = 3000


@pytest.fixture
def small(pretend_app: Callable[..., FastAPI], serve: Any) -> httpx.Client:
    return serve(pretend_app(max_upload_bytes=LIMIT))


def test_a_declared_length_over_the_limit(small: httpx.Client, problem: Any) -> None:
    response = small.post("/infer", files={"mesh": ("a.obj", b"v" * LIMIT)})
    document = problem(response, 413, "body_too_large")
    assert str(LIMIT) in document.detail
    assert small.get("/livez").status_code == 200


def test_a_declared_length_is_refused_before_the_body_comes(small: httpx.Client) -> None:
    address = (small.base_url.host, small.base_url.port)
    with socket.create_connection(address, timeout=10) as connection:
        connection.sendall(
            b"POST /infer HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\n"
            b"Content-Type: multipart/form-data; boundary=x\r\n\r\n"
        )
        assert connection.recv(12) == b"HTTP/1.1 413"


def test_a_stream_that_runs_over_the_limit(small: httpx.Client, problem: Any) -> None:
    request = small.build_request("POST", "/infer", files={"mesh": ("a.obj", b"v" * LIMIT)})
    body = request.read()

    def chunks() -> Iterator[bytes]:
        for start in range(0, len(body), 100):
            yield body[start : start + 100]

    headers = {"content-type": request.headers["content-type"]}
    response = small.post("/infer", content=chunks(), headers=headers)
    assert "content-length" not in response.request.headers
    problem(response, 413, "body_too_large")


def test_a_body_at_the_limit_passes(small: httpx.Client) -> None:
    frame = len(small.build_request("POST", "/", files={"mesh": ("a.obj", b"")}).read())
    response = small.post("/infer", files={"mesh": ("a.obj", b"v" * (LIMIT - frame))})
    assert int(response.request.headers["content-length"]) == LIMIT
    assert response.status_code == 200


PART = b'--x\r\nContent-Disposition: form-data; name="mesh"; filename="a.obj"\r\n\r\n'
KIND = "multipart/form-data; boundary=x"


@pytest.fixture
def hasty(pretend_app: Callable[..., FastAPI], serve: Any) -> int:
    """The port of a service that wants 300 bytes of a body each 0.3 s."""
    port = serve(pretend_app(body_seconds=0.3)).base_url.port
    assert port is not None
    return port


@pytest.mark.parametrize("drip", [b"", b"x"])
def test_a_body_that_dawdles(hasty: int, drip: bytes) -> None:
    with connected(hasty) as connection:
        connection.sendall(head("/infer", content_length=100_000, content_type=KIND) + PART)
        connection.settimeout(0.02)
        answer = b""
        while not answer:
            connection.sendall(drip)
            with suppress(TimeoutError):
                answer = connection.recv(12, socket.MSG_PEEK)
        connection.settimeout(20)
        told = reply(connection)
        assert (told.status, json.loads(told.body)["code"]) == (408, "body_too_slow")
        assert told.headers["connection"] == "close"


def test_a_body_that_is_slow_but_steady_passes(hasty: int) -> None:
    body = PART + b"x" * 4000 + b"\r\n--x--\r\n"
    with connected(hasty) as connection:
        connection.sendall(head("/infer", content_length=len(body), content_type=KIND))
        for start in range(0, len(body), 400):
            time.sleep(0.05)
            connection.sendall(body[start : start + 400])
        assert reply(connection).status == 200


def test_a_client_that_leaves_while_it_sends_is_noted_as_such(
    hasty: int, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO, "service.access"):
        with connected(hasty) as connection:
            connection.sendall(head("/infer", content_length=100_000, content_type=KIND) + PART)
        until(lambda: "/infer 499" in caplog.text)
