from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from wire import closes, connected, head, reply

from service.api import linger
from service.api.linger import SMALL, Linger

LARGE = 8 * 1024 * 1024


async def refuse(scope: Any, receive: Any, send: Any) -> None:
    if scope["type"] != "http":
        return
    if scope["path"] == "/read":
        while (await receive()).get("more_body"):
            pass
    headers = [(b"content-length", b"2")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": b"no"})


@pytest.fixture(scope="module")
def port(serving: Callable[..., Any]) -> Iterator[int]:
    with serving(Linger(refuse)) as client:
        assert client.base_url.port is not None
        yield client.base_url.port


def test_a_client_that_sends_all_first_reads_the_answer(port: int) -> None:
    for _ in range(5):
        with connected(port) as connection:
            connection.sendall(head("/", content_length=LARGE))
            connection.sendall(b"x" * LARGE)
            answer = reply(connection)
            assert (answer.status, answer.body) == (403, b"no")
            assert answer.headers["connection"] == "close"
            assert closes(connection)


def test_the_answer_does_not_wait_for_the_body(port: int) -> None:
    with connected(port) as connection:
        connection.sendall(head("/", content_length=LARGE))
        assert reply(connection).status == 403


def test_who_asks_before_sending_is_not_told_to(port: int) -> None:
    with connected(port) as connection:
        connection.sendall(head("/", content_length=LARGE, expect="100-continue"))
        # An interim answer would be skipped by `reply`.
        assert connection.recv(12, socket.MSG_PEEK) == b"HTTP/1.1 403"
        assert reply(connection).headers["connection"] == "close"


def test_a_body_that_never_ends_is_not_taken_for_ever(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(linger, "MOST", 100_000)
    with connected(port) as connection:
        connection.sendall(head("/", transfer_encoding="chunked"))
        chunk = b"10000\r\n" + b"x" * 0x10000 + b"\r\n"
        with pytest.raises(ConnectionError):  # noqa: PT012
            while True:
                connection.sendall(chunk)


def test_a_body_that_never_comes_is_not_waited_for(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(linger, "PATIENCE_S", 0.05)
    with connected(port) as connection:
        connection.sendall(head("/", content_length=LARGE))
        assert reply(connection).status == 403
        assert closes(connection)


@pytest.mark.parametrize("path", ["/", "/read"])
def test_a_small_body_keeps_the_connection(port: int, path: str) -> None:
    with connected(port) as connection:
        for size in (0, 1, SMALL):
            connection.sendall(head(path, content_length=size) + b"x" * size)
            assert "connection" not in reply(connection).headers


def test_a_body_that_was_read_keeps_the_connection(port: int) -> None:
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
        assert "connection" not in client.post("/read", content=b"x" * LARGE).headers
