from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from starlette.exceptions import HTTPException
from wire import closes, connected, head, reply, until

from service.api import admission
from service.api.admission import Admission
from service.api.context import Context
from service.api.workers import Workers

MESH = {"mesh": ("a.obj", b"v 0 0 0")}
MIB = 1 << 20
FORM = "multipart/form-data; boundary=x"
PART = b'--x\r\nContent-Disposition: form-data; name="mesh"; filename="a.obj"\r\n\r\n'


def refused(call: Callable[[], Any]) -> HTTPException:
    with pytest.raises(HTTPException) as caught:
        call()
    assert caught.value.status_code == 429
    return caught.value


def test_workers_and_queue_make_the_places() -> None:
    gate = Admission(Workers(2), 1, 1000)
    requests = [gate.enter(0) for _ in range(3)]
    refused(lambda: gate.enter(0))
    assert (gate.held, gate.rejected["places"]) == (3, 1)
    requests[0].answered = True
    gate.leave(gate.enter(0))
    for request in requests:
        gate.leave(request)
    assert gate.held == 0


@pytest.mark.parametrize(("pace", "seconds"), [(0.0, "1"), (0.1, "1"), (1.5, "3"), (40.0, "60")])
def test_retry_after_is_the_work_ahead(pace: float, seconds: str) -> None:
    workers = Workers(2)
    workers.pace = pace
    gate = Admission(workers, 1, 1000)
    for _ in range(3):
        gate.enter(0)
    assert refused(lambda: gate.enter(0)).headers == {"Retry-After": seconds}


def test_refusals_beyond_a_second_s_worth_are_held(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(admission, "REFUSALS", 10)
    monkeypatch.setattr(admission, "LONGEST_HOLD_S", 1.0)
    monkeypatch.setattr(admission.time, "monotonic", lambda: 100.0)
    gate = Admission(Workers(1), 0, 1000)
    assert [gate.hold() for _ in range(10)] == [0.0] * 10
    holds = [gate.hold() for _ in range(20)]
    assert holds == sorted(holds)
    assert 0 < holds[2] < 0.5
    assert holds[-1] == 1.0
    # A second later there is room again for one now and then.
    monkeypatch.setattr(admission.time, "monotonic", lambda: 101.0)
    assert 0 < gate.hold() <= 0.2
    monkeypatch.setattr(admission.time, "monotonic", lambda: 103.0)
    assert gate.hold() == 0.0


def test_declared_bytes_are_held_up_front() -> None:
    gate = Admission(Workers(9), 0, 100 * MIB)
    first = gate.enter(100 * MIB)
    refused(lambda: gate.enter(MIB))
    assert gate.held_bytes == 100 * MIB
    # What names a mesh by its id is let in all the same.
    gate.leave(gate.enter(1000))
    gate.leave(first)
    # One alone may be larger.
    gate.enter(600 * MIB)


def test_bytes_that_were_not_declared_count_as_they_come() -> None:
    gate = Admission(Workers(9), 0, 100 * MIB)
    first, second = gate.enter(0), gate.enter(0)
    gate.receive(first, 60 * MIB, whole=False)
    gate.receive(second, 40 * MIB, whole=False)
    refused(lambda: gate.receive(second, 1, whole=True))
    gate.leave(second)
    gate.receive(first, 60 * MIB, whole=True)
    assert gate.held_bytes == 120 * MIB


def test_a_slow_body_holds_what_has_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(admission, "PROMPT_S", 0.0)
    gate = Admission(Workers(1), 0, 100 * MIB)
    slow = [gate.enter(90 * MIB) for _ in range(5)]
    assert (gate.held, gate.held_bytes) == (0, 0)
    # What is whole takes a place; late ones have as many again.
    gate.receive(slow[0], 10, whole=True)
    refused(lambda: gate.enter(1))
    gate.receive(slow[1], 10, whole=True)
    assert (gate.held, gate.held_bytes) == (2, 20)
    refused(lambda: gate.receive(slow[2], 10, whole=True))
    for request in slow:
        gate.leave(request)
    assert (gate.held, gate.held_bytes) == (0, 0)


@dataclass
class Tiny:
    """A service whose work waits for the gate, and what it has inside."""

    client: httpx.Client
    context: Context
    gate: threading.Event
    entered: threading.Semaphore

    @property
    def port(self) -> int:
        assert self.client.base_url.port is not None
        return self.client.base_url.port

    def infer(self) -> httpx.Response:
        return self.client.post("/infer", files=MESH)

    def is_empty(self) -> bool:
        workers, gate = self.context.workers, self.context.admission
        return (workers.working, workers.queued, gate.held, gate.held_bytes) == (0, 0, 0, 0)


@pytest.fixture
def tiny(
    pretend_app: Callable[..., FastAPI],
    pretend: Any,
    serve: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[Tiny]:
    """One worker, and one place in the queue."""
    monkeypatch.setattr(admission, "PROMPT_S", 60.0)
    app = pretend_app(workers=1, queue=1, max_pending_bytes=1_000_000)
    made = Tiny(serve(app), app.state.context, threading.Event(), threading.Semaphore(0))

    def work() -> None:
        made.entered.release()
        assert made.gate.wait(20)

    pretend.work = work
    until(lambda: made.client.get("/readyz").status_code == 200)
    try:
        yield made
    finally:
        made.gate.set()


@pytest.fixture
def full(tiny: Tiny) -> Iterator[Tiny]:
    """Both places are taken."""
    with ThreadPoolExecutor(2) as pool:
        answers = [pool.submit(tiny.infer) for _ in range(2)]
        until(lambda: tiny.context.workers.queued == 1)
        try:
            yield tiny
        finally:
            tiny.gate.set()
        assert [answer.result().status_code for answer in answers] == [200, 200]
        until(tiny.is_empty)


def test_what_comes_beyond_is_told_when_to_come_again(full: Tiny, problem: Any) -> None:
    response = full.infer()
    document = problem(response, 429, "overloaded")
    assert "2 places" in document.detail
    assert int(response.headers["retry-after"]) >= 1
    assert full.context.admission.rejected == {"places": 1, "bytes": 0}
    for path in ("/livez", "/readyz", "/categories"):
        assert full.client.get(path).status_code == 200


def test_it_is_refused_before_its_body_comes(full: Tiny) -> None:
    with connected(full.port) as connection:
        connection.sendall(
            head("/infer", content_length=500_000, content_type=FORM, expect="100-continue")
        )
        answer = reply(connection)
        assert answer.status == 429
        assert answer.headers["connection"] == "close"


def test_it_may_send_its_body_all_the_same(full: Tiny) -> None:
    with connected(full.port) as connection:
        connection.sendall(head("/infer", content_length=5_000_000, content_type=FORM))
        connection.sendall(b"x" * 5_000_000)
        assert reply(connection).status == 429
        assert closes(connection)


def test_a_body_over_the_limit_is_told_so_even_then(full: Tiny) -> None:
    with connected(full.port) as connection:
        connection.sendall(head("/infer", content_length=1 << 40, content_type=FORM))
        assert reply(connection).status == 413


def test_bytes_beyond_are_refused_while_they_stream(tiny: Tiny, problem: Any) -> None:
    with connected(tiny.port) as connection:
        connection.sendall(head("/infer", content_length=900_000, content_type=FORM))
        until(lambda: tiny.context.admission.held_bytes == 900_000)

        def chunks() -> Iterator[bytes]:
            yield PART
            for _ in range(4):
                yield b"x" * 50_000

        response = tiny.client.post("/infer", content=chunks(), headers={"content-type": FORM})
        problem(response, 429, "overloaded")
    until(tiny.is_empty)


def test_clients_that_leave_while_they_send(tiny: Tiny) -> None:
    for sent in (b"", b"--x\r\n", PART + b"x" * 100_000):
        with connected(tiny.port) as connection:
            connection.sendall(head("/infer", content_length=500_000, content_type=FORM) + sent)
            until(lambda: tiny.context.admission.held == 1)
        until(tiny.is_empty)


def send_mesh(tiny: Tiny, connection: Any) -> None:
    request = tiny.client.build_request("POST", "/infer", files=MESH)
    body = request.read()
    kind = request.headers["content-type"]
    connection.sendall(head("/infer", content_length=len(body), content_type=kind) + body)


def test_a_client_that_leaves_the_queue(tiny: Tiny, pretend: Any) -> None:
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(tiny.infer)
        assert tiny.entered.acquire(timeout=20)
        with connected(tiny.port) as connection:
            send_mesh(tiny, connection)
            until(lambda: tiny.context.workers.queued == 1)
        until(lambda: tiny.context.workers.queued == 0 and tiny.context.admission.held == 1)
        tiny.gate.set()
        assert first.result().status_code == 200
    until(tiny.is_empty)
    assert len(pretend.calls) == 1


@pytest.mark.parametrize("half", [True, False])
def test_a_client_that_leaves_while_it_is_worked_for(tiny: Tiny, pretend: Any, half: bool) -> None:
    from service import deadline

    def work() -> None:
        tiny.entered.release()
        while not tiny.gate.wait(0.001):
            deadline.check()

    pretend.work = work
    with connected(tiny.port) as connection:
        send_mesh(tiny, connection)
        assert tiny.entered.acquire(timeout=20)
        if half:
            connection.shutdown(1)
            assert closes(connection)
    # Nobody opens the gate: the work ends by itself.
    until(tiny.is_empty)


def test_a_client_that_leaves_while_its_answer_is_sent(tiny: Tiny) -> None:
    tiny.gate.set()
    files = {"mesh": ("a.obj", b"v" * 12_000_000)}
    request = tiny.client.build_request("POST", "/edit", files=files, data={"edits": "{}"})
    body, kind = request.read(), request.headers["content-type"]
    with connected(tiny.port) as connection:
        connection.sendall(head("/edit", content_length=len(body), content_type=kind) + body)
        assert connection.recv(12) == b"HTTP/1.1 200"
        # Its place is free again, its bytes are not.
        until(lambda: tiny.context.admission.held == 0)
        assert tiny.context.admission.held_bytes == len(body)
    until(tiny.is_empty)


def test_a_storm(pretend_app: Callable[..., FastAPI], pretend: Any, serve: Any) -> None:
    app = pretend_app(workers=2, queue=2)
    client: httpx.Client = serve(app)
    tiny = Tiny(client, app.state.context, threading.Event(), threading.Semaphore(0))
    until(lambda: client.get("/readyz").status_code == 200)
    pretend.work = lambda: tiny.gate.wait(0.005)

    def storm(number: int) -> set[int]:
        statuses = set()
        with httpx.Client(base_url=client.base_url, timeout=60, trust_env=False) as own:
            for turn in range(6):
                if (number + turn) % 5 == 0:
                    with connected(tiny.port) as connection:
                        send_mesh(tiny, connection)
                    continue
                size = 200_000 if turn % 2 else 10
                files = {"mesh": ("a.obj", b"v" * size)}
                statuses.add(own.post("/infer", files=files).status_code)
        return statuses

    with ThreadPoolExecutor(64) as pool:
        storms = [pool.submit(storm, number) for number in range(64)]
        probes = []
        while not all(done.done() for done in storms):
            probes.append(client.get("/livez").status_code)
        statuses = set().union(*(done.result() for done in storms))
    assert statuses == {200, 429}
    assert set(probes) == {200}
    until(tiny.is_empty)
