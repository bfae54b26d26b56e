from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

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
