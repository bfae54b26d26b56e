"""What the server answers by itself: heads and bodies that are slow, endless or no HTTP."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import httpx
import pytest
from provoke import BOX, client_of, provokes, refused, told
from wire import connected, head, reply

from service import server
from service.main import create_app
from service.server import Config, Server, listen
from service.settings import Settings

Run = Callable[..., httpx.Client]


@contextmanager
def running(**settings: Any) -> Iterator[httpx.Client]:
    """A client of the service behind its own server."""
    listeners = listen("127.0.0.1", 0)
    settled = Settings(categories=("debug",), **settings)
    app = create_app(settled)
    own = Server(Config(app, settled), app.state.context)
    thread = threading.Thread(target=own.run, args=[listeners])
    thread.start()
    try:
        url = f"http://127.0.0.1:{listeners[0].getsockname()[1]}"
        with httpx.Client(base_url=url, trust_env=False) as http:
            yield http
    finally:
        own.should_exit = True
        thread.join()


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Iterator[Run]:
    """Starts a server with some settings, for the length of a test."""
    monkeypatch.setattr(server, "SWEEP_S", 0.01)
    with ExitStack() as stack:
        yield lambda **settings: stack.enter_context(running(**settings))


def port_of(http: httpx.Client) -> int:
    assert http.base_url.port is not None
    return http.base_url.port


@provokes(too_many_connections=429)
def test_more_connections_than_may_be_open(run: Run) -> Any:
    http = run(max_connections=1)
    with connected(port_of(http)) as first:
        first.sendall(head("/livez", "GET"))
        assert reply(first).status == 200
        refusal = refused(lambda: client_of(http).infer(BOX))
    assert refusal.retry_after == 1
    return refusal


@provokes(head_too_large=431)
def test_a_head_without_end(run: Run) -> Any:
    client = client_of(run())
    headers = {f"X-{number}": "y" * 10_000 for number in range(100)}
    return refused(lambda: client.post("/categories", method="GET", headers=headers))


@provokes(head_too_slow=408, http_malformed=400, length_ambiguous=400)
def test_what_no_client_library_sends(run: Run, code: str) -> Any:
    sent = {
        "head_too_slow": b"GET / HTTP/1.1\r\nHost: x\r\nX-Slow: ",
        "http_malformed": b"\x16\x03\x01\x02\x00\x01\r\n\r\n",
        "length_ambiguous": head("/infer", content_length=4, transfer_encoding="chunked"),
    }
    seconds = 0.2 if code == "head_too_slow" else 20
    with connected(port_of(run(header_seconds=seconds))) as connection:
        connection.sendall(sent[code])
        answer = reply(connection)
        return told(answer.status, answer.body)


@provokes(body_too_slow=408)
def test_a_body_that_dawdles(run: Run) -> Any:
    client = client_of(run(body_seconds=0.2))
    told = []

    def dawdle(done: int, total: int | None) -> None:
        told.append(done)
        if done < (total or 0):
            time.sleep(0.5)

    refusal = refused(lambda: client.infer(BOX, progress=dawdle))
    assert told
    return refusal
