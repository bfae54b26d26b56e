from __future__ import annotations

import socket
import threading
import time
from typing import Any

import httpx
import pytest
from prometheus_client.core import Metric
from prometheus_client.openmetrics.parser import (
    text_string_to_metric_families as parse_openmetrics,
)
from prometheus_client.parser import text_string_to_metric_families as parse

from service import deadline

# What Prometheus 3 sends.
PROMETHEUS = (
    "application/openmetrics-text;version=1.0.0;escaping=allow-utf-8;q=0.6,"
    "application/openmetrics-text;version=0.0.1;q=0.5,"
    "text/plain;version=1.0.0;escaping=allow-utf-8;q=0.4,text/plain;version=0.0.4;q=0.3,*/*;q=0.2"
)


def names(families: Any) -> set[str]:
    found: list[Metric] = list(families)
    assert len({family.name for family in found}) == len(found)
    return {family.name for family in found}


def value(client: httpx.Client, name: str, **labels: str) -> float | None:
    for family in parse(client.get("/metrics").text):
        for sample in family.samples:
            if (sample.name, sample.labels) == (f"shape_parameters_{name}", labels):
                return sample.value
    return None


def until(client: httpx.Client, expected: float, name: str, **labels: str) -> None:
    end = time.monotonic() + 30
    while (found := value(client, name, **labels)) != expected:
        assert time.monotonic() < end, f"{name} is {found}"


@pytest.mark.parametrize("accept", ["*/*", "text/plain", "nonsense", "text/plain;version=0.0.4"])
def test_a_browser_and_an_old_prometheus_have_the_text_format(
    client: httpx.Client, accept: str
) -> None:
    answer = client.get("/metrics", headers={"Accept": accept})
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    assert "shape_parameters_workers" in names(parse(answer.text))


def test_prometheus_has_openmetrics(client: httpx.Client) -> None:
    client.post("/infer", files={"mesh": ("a.obj", b"abc")})
    answer = client.get("/metrics", headers={"Accept": PROMETHEUS})
    assert answer.headers["content-type"].startswith("application/openmetrics-text; version=1.0.0")
    assert answer.headers["vary"] == "Accept"
    found = names(parse_openmetrics(answer.text))
    assert found == names(parse(client.get("/metrics").text))
    assert {"process_resident_memory_bytes", "process_open_fds", "python_info"} <= found
    assert not any(name.endswith("_created") for name in found)


def test_it_can_be_asked_for_by_head_and_nothing_else(client: httpx.Client, problem: Any) -> None:
    assert client.head("/metrics").status_code == 200
    problem(client.post("/metrics"), 405, "method_not_allowed")


def test_it_tells_of_requests_that_are_in_work_and_in_queue(
    pretend_app: Any, pretend: Any, serve: Any
) -> None:
    gate, entered = threading.Event(), threading.Semaphore(0)

    def work() -> None:
        entered.release()
        assert gate.wait(30)

    pretend.work = work
    client = serve(pretend_app(workers=1, queue=1))

    def send() -> None:
        client.post("/infer", files={"mesh": ("a.obj", b"abc")})

    threads = [threading.Thread(target=send) for _ in range(2)]
    try:
        for thread in threads:
            thread.start()
        assert entered.acquire(timeout=30)
        until(client, 1, "working_requests")
        until(client, 1, "queue_requests")
        # The two, and the one that asks.
        until(client, 3, "open_requests")
        refused = client.post("/infer", files={"mesh": ("a.obj", b"abc")})
        assert refused.status_code == 429
        text = client.get("/metrics").text
        assert 'shape_parameters_admission_rejections_total{reason="places"} 1.0' in text
        assert 'shape_parameters_problems_total{code="overloaded"} 1.0' in text
    finally:
        gate.set()
        for thread in threads:
            thread.join()
    until(client, 0, "working_requests")
    until(client, 0, "queue_requests")
    until(client, 1, "open_requests")


def test_clients_that_leave_are_counted_and_leave_no_gauge_up(
    pretend_app: Any, pretend: Any, serve: Any
) -> None:
    entered = threading.Semaphore(0)

    def work() -> None:
        entered.release()
        end = time.monotonic() + 30
        while time.monotonic() < end:
            deadline.check()
            time.sleep(0.01)
        raise TimeoutError("nobody told that the client has left")

    pretend.work = work
    client = serve(pretend_app(workers=1, queue=1))
    whole = client.build_request("POST", "/infer", files={"mesh": ("a.obj", b"abc")})
    body = whole.read()
    lines = [f"{name}: {value}" for name, value in whole.headers.items()]
    head = "\r\n".join(["POST /infer HTTP/1.1", *lines, "", ""]).encode()
    gone = {"route": "/infer", "method": "POST", "status": "499"}
    address = client.base_url.host, client.base_url.port
    for number, sent in enumerate((body[:50], body)):
        with socket.create_connection(address) as connection:
            connection.sendall(head + sent)
            if sent == body:
                assert entered.acquire(timeout=30)
            else:
                until(client, 2, "open_requests")
        until(client, number + 1, "request_duration_seconds_count", **gone)
    until(client, 0, "working_requests")
    until(client, 1, "open_requests")
    assert value(client, "request_duration_seconds_count", **gone | {"status": "500"}) is None
