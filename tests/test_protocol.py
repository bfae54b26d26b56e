from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest
from wire import Reply, closes, connected, head, reply, until

from service import protocol, server
from service.api.metrics import Metrics
from service.server import Config, Server, listen
from service.settings import Settings

LARGE = 32 * 1024 * 1024
"""More than the buffers between two sockets hold."""


LEFT = threading.Semaphore(0)
"""Clients that the app waited for, and that left."""


async def _app(scope: Any, receive: Any, send: Any) -> None:
    """Reads nothing but where it waits for its client to leave; answers at once."""
    if scope["type"] == "lifespan":
        while True:
            kind = (await receive())["type"]
            await send({"type": f"{kind}.complete"})
            if kind == "lifespan.shutdown":
                return
    if scope["path"] == "/wait":
        while (await receive())["type"] != "http.disconnect":
            pass
        LEFT.release()
        return
    size = LARGE if scope["path"] == "/large" else 2
    headers = [(b"content-length", b"%d" % size)]
    await send({"type": "http.response.start", "status": 200, "headers": headers})
    for _ in range(0, size, 65536):
        body = b"x" * min(size, 65536)
        await send({"type": "http.response.body", "body": body, "more_body": True})
    await send({"type": "http.response.body", "body": b""})


# The server takes a FastAPI app, for its state.
app: Any = _app


@contextmanager
def running(**settings: Any) -> Iterator[tuple[int, Server]]:
    """The port of a server with these settings, and itself."""
    listeners = listen("127.0.0.1", 0)
    readiness = SimpleNamespace(draining=False, drain=lambda: None)
    app.state = SimpleNamespace(context=SimpleNamespace(metrics=Metrics(), readiness=readiness))
    own = Server(Config(app, Settings(**settings)), app.state.context)
    port = listeners[0].getsockname()[1]
    thread = threading.Thread(target=own.run, args=[listeners])
    thread.start()
    try:
        yield port, own
    finally:
        own.should_exit = True
        thread.join()
    assert own.complete


@pytest.fixture(autouse=True)
def swept_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "SWEEP_S", 0.01)
    monkeypatch.setattr(protocol, "LINGER_S", 0.1)


def check(answer: Reply, status: int, code: str) -> None:
    document = json.loads(answer.body)
    assert (answer.status, document["status"], document["code"]) == (status, status, code)
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["trace-id"] == document["trace_id"]
    assert answer.headers["connection"] == "close"
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert document["suggestion"]


def test_a_head_that_does_not_come_whole() -> None:
    with running(header_seconds=0.2) as (port, own), connected(port) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: x\r\nX-Slow: ")
        check(reply(connection), 408, "head_too_slow")
        assert closes(connection)
        until(lambda: not own.server_state.connections)


def test_bytes_now_and_then_give_it_no_more_time() -> None:
    with running(header_seconds=0.2) as (port, _), connected(port) as connection:
        connection.settimeout(0.02)
        connection.sendall(b"GET / HTTP/1.1\r\n")
        answer = b""
        while not answer:
            connection.sendall(b"X: y\r\n")
            try:
                answer = connection.recv(12)
            except TimeoutError:
                continue
        assert answer == b"HTTP/1.1 408"


def test_a_connection_on_which_nothing_comes_is_closed() -> None:
    with running(header_seconds=0.1) as (port, _), connected(port) as connection:
        assert closes(connection)


def test_a_second_head_has_its_time_too() -> None:
    with running(header_seconds=0.3) as (port, _), connected(port) as connection:
        for _ in range(2):
            connection.sendall(head("/", "GET"))
            assert reply(connection).status == 200
        connection.sendall(b"GET / HTTP/1.1\r\n")
        check(reply(connection), 408, "head_too_slow")


def test_an_idle_connection_is_kept_so_long() -> None:
    times = {"keep_alive_seconds": 0.4, "header_seconds": 0.1}
    with running(**times) as (port, _), connected(port) as connection:
        for _ in range(2):
            connection.sendall(head("/", "GET"))
            assert reply(connection).status == 200
            # Longer than a head has.
            time.sleep(0.2)
        assert closes(connection)


def test_a_head_without_end() -> None:
    with running() as (port, _), connected(port) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nX: " + b"y" * 100_000)
        check(reply(connection), 431, "head_too_large")
        assert closes(connection)


@pytest.mark.parametrize(
    "data",
    [
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n",
        b"GET\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
    ],
)
def test_what_is_no_http(data: bytes) -> None:
    with running() as (port, _), connected(port) as connection:
        connection.sendall(data)
        check(reply(connection), 400, "http_malformed")
        assert closes(connection)


def test_a_body_that_is_no_http() -> None:
    with running() as (port, _), connected(port) as connection:
        connection.sendall(head("/wait", transfer_encoding="chunked") + b"not a length\r\n")
        check(reply(connection), 400, "http_malformed")
        assert LEFT.acquire(timeout=20)


@pytest.mark.parametrize("leave", [lambda c: c.close(), lambda c: c.shutdown(1)])
def test_who_closes_the_sending_half_has_left(leave: Callable[[Any], None]) -> None:
    with running() as (port, own), connected(port) as connection:
        connection.sendall(head("/wait", "GET"))
        until(lambda: bool(own.server_state.tasks))
        leave(connection)
        assert LEFT.acquire(timeout=20)
        until(lambda: not own.server_state.connections)


def test_a_client_that_does_not_read_its_answer() -> None:
    with running(body_seconds=0.2) as (port, own), connected(port) as connection:
        connection.sendall(head("/large", "GET"))
        until(lambda: bool(own.server_state.tasks))
        until(lambda: not own.server_state.connections and not own.server_state.tasks)


def test_a_client_that_reads_slowly_but_does() -> None:
    with running(body_seconds=0.5) as (port, _), connected(port) as connection:
        connection.sendall(head("/large", "GET"))
        left = LARGE
        while left > 0:
            got = len(connection.recv(1 << 20))
            assert got, "it was cut off"
            left -= got
            time.sleep(0.01)


def test_the_rest_of_a_body_that_nobody_reads() -> None:
    with running() as (port, own), connected(port) as connection:
        connection.sendall(head("/", content_length=100))
        assert reply(connection).status == 200
        for _ in range(3):
            connection.sendall(b"x")
        assert closes(connection)
        until(lambda: not own.server_state.connections)


def test_beyond_the_most_connections_probes_alone_are_answered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(protocol, "SPARE", 2)
    with running(max_connections=1) as (port, own), connected(port) as first:
        first.sendall(head("/", "GET"))
        assert reply(first).status == 200
        with connected(port) as second, connected(port) as third:
            second.sendall(head("/", content_length=5) + b"12345")
            third.sendall(head("/livez", "GET"))
            answer = reply(second)
            check(answer, 429, "too_many_connections")
            assert answer.headers["retry-after"] == "1"
            assert closes(second)
            assert reply(third).status == 200
            until(lambda: len(own.server_state.connections) == 2)
            with connected(port) as fourth, connected(port) as fifth:
                until(lambda: len(own.server_state.connections) == 3)
                assert closes(fifth)
                fourth.sendall(head("/readyz", "GET"))
                assert reply(fourth).status == 200
        first.sendall(head("/", "GET"))
        assert reply(first).status == 200


def test_an_upgrade_is_declined_without_a_word(caplog: pytest.LogCaptureFixture) -> None:
    with running() as (port, _), connected(port) as connection:
        for protocol_name in ("websocket", "h2c"):
            connection.sendall(head("/", "GET", connection="Upgrade", upgrade=protocol_name))
            assert reply(connection).status == 200
    assert [entry for entry in caplog.records if entry.levelname == "WARNING"] == []
