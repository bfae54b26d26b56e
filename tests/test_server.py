from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import httpx
import pytest
from wire import PATIENCE_S, closes, connected, head, reply, until

from service import __main__
from service.server import listen, url

# The service, but for its pipeline: work waits for a line on standard input.
SCRIPT = """
import sys
from types import SimpleNamespace
from service import __main__, pipeline

def infer(*arguments):
    print("at work", flush=True)
    sys.stdin.readline()
    return SimpleNamespace(report=lambda: {"mesh_id": "sha256-1", "category": "stool"})

pipeline.infer = infer
sys.exit(__main__.main(["--port", sys.argv[1]]))
"""


@dataclass
class Running:
    """The service in a process of its own, with its clients."""

    process: subprocess.Popen[str]
    port: int

    def get(self, path: str) -> httpx.Response:
        return httpx.get(f"http://127.0.0.1:{self.port}{path}", trust_env=False, timeout=PATIENCE_S)

    def infer(self) -> httpx.Response:
        url = f"http://127.0.0.1:{self.port}/infer"
        files = {"mesh": ("a.obj", b"v 0 0 0")}
        return httpx.post(url, files=files, trust_env=False, timeout=PATIENCE_S)

    def is_ready(self) -> bool:
        assert self.process.poll() is None
        try:
            return self.get("/readyz").status_code == 200
        except httpx.TransportError:
            return False

    def finish(self) -> None:
        """Let one piece of work end."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def await_work(self) -> None:
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "at work\n"


@contextmanager
def service(**settings: Any) -> Iterator[Running]:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(port)],
        env={
            **os.environ,
            "CATEGORIES": "debug",
            **{name.upper(): str(value) for name, value in settings.items()},
        },
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    running = Running(process, port)
    try:
        until(running.is_ready)
        yield running
    finally:
        process.kill()
        process.communicate()


def test_sigterm_says_so_serves_on_and_ends_in_good_order() -> None:
    with service(drain_seconds=1, workers=1) as running, ThreadPoolExecutor(2) as pool:
        answer = pool.submit(running.infer)
        running.await_work()
        with connected(running.port) as kept:
            running.process.send_signal(signal.SIGTERM)
            until(lambda: running.get("/readyz").status_code == 503)
            response = running.get("/readyz")
            assert response.json()["code"] == "draining"
            # Who comes all the same is served, and told to go elsewhere next.
            kept.sendall(head("/livez", "GET"))
            told = reply(kept)
            assert (told.status, told.headers["connection"]) == (200, "close")
            assert closes(kept)
        late = pool.submit(running.infer)
        until(lambda: refuses(running.port))
        running.finish()
        running.await_work()
        running.finish()
        assert answer.result().status_code == late.result().status_code == 200
        assert running.process.wait(PATIENCE_S) == 0


def refuses(port: int) -> bool:
    try:
        with connected(port):
            return False
    except ConnectionRefusedError:
        return True


def test_ctrl_c_stops_at_once() -> None:
    with service(drain_seconds=60) as running, connected(running.port) as idle:
        idle.sendall(head("/livez", "GET"))
        assert reply(idle).status == 200
        running.process.send_signal(signal.SIGINT)
        assert closes(idle)
        assert running.process.wait(PATIENCE_S) == 0


@pytest.mark.parametrize("second", [signal.SIGTERM, signal.SIGINT])
def test_a_second_signal_does_not_wait_for_work(second: signal.Signals) -> None:
    with service(drain_seconds=60, grace_seconds=60) as running, connected(running.port) as cut:
        send_work(running, cut)
        running.process.send_signal(signal.SIGTERM)
        until(lambda: running.get("/readyz").status_code == 503)
        running.process.send_signal(second)
        assert running.process.wait(PATIENCE_S) == 1
        assert closes(cut)


def test_work_that_outlasts_the_grace_is_cut_off() -> None:
    with service(drain_seconds=0, grace_seconds=0.2) as running, connected(running.port) as cut:
        send_work(running, cut)
        running.process.send_signal(signal.SIGTERM)
        assert running.process.wait(PATIENCE_S) == 1
        assert closes(cut)


def send_work(running: Running, connection: socket.socket) -> None:
    """Begin work over a connection of one's own."""
    files = {"mesh": ("a.obj", b"v 0 0 0")}
    request = httpx.Request("POST", "http://x/infer", files=files)
    body, kind = request.read(), request.headers["content-type"]
    connection.sendall(head("/infer", content_length=len(body), content_type=kind) + body)
    running.await_work()


def test_a_port_that_is_taken_is_told_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert __main__.main(["--host", "127.0.0.1", "--port", str(port)]) == 1
    told = capsys.readouterr().err
    assert f"127.0.0.1:{port}" in told
    assert "already in use" in told
    assert told.count("\n") == 1


def test_a_host_that_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert __main__.main(["--host", "203.0.113.1", "--port", "0"]) == 1
    assert "203.0.113.1" in capsys.readouterr().err


def test_where_it_listens() -> None:
    listeners = listen("localhost", 0)
    try:
        assert len(listeners) == 1
        port = listeners[0].getsockname()[1]
        assert url(listeners[0]) in (f"http://127.0.0.1:{port}", f"http://[::1]:{port}")
    finally:
        for listener in listeners:
            listener.close()


def test_no_answer_waits_for_the_client_to_acknowledge_its_head() -> None:
    (listener,) = listen("127.0.0.1", 0)
    with listener, socket.create_connection(listener.getsockname()), listener.accept()[0] as end:
        assert end.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) != 0
