from __future__ import annotations

import re
import socket
import threading
from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import httpx
from fastapi import FastAPI
from prometheus_client.core import Metric
from prometheus_client.parser import text_string_to_metric_families

from service.api.metrics import BYTE_BUCKETS, PREFIX, Metrics
from service.logs import Identity
from service.server import Config, Server, listen
from service.settings import Settings
from service.stages import STAGES, Record

STANDARD = ("process_", "python_")
"""What Prometheus's own client names, the same for each service in Python."""

NO_BASE_UNITS = ("milliseconds", "ms", "minutes", "kilobytes", "mebibytes", "percent")


def lint(families: Iterable[Metric]) -> list[str]:
    """What the conventions of Prometheus for names would have otherwise."""
    faults = []
    for family in families:
        name, kind = family.name, family.type
        own = name.removeprefix(f"{PREFIX}_")
        if not re.fullmatch("[a-z][a-z0-9_]*", name) or "__" in name:
            faults.append(f"{name}: not in snake case")
        if own == name and not name.startswith(STANDARD):
            faults.append(f"{name}: no prefix")
        if not family.documentation.endswith("."):
            faults.append(f"{name}: no sentence tells what it is")
        if any(part in NO_BASE_UNITS for part in own.split("_")):
            faults.append(f"{name}: no base unit")
        if kind == "histogram" and not name.endswith(("_seconds", "_bytes")):
            faults.append(f"{name}: a histogram of what?")
        if kind == "gauge" and name.endswith("_total"):
            faults.append(f"{name}: a gauge is no total")
        if kind not in {"counter", "gauge", "histogram"}:
            faults.append(f"{name}: an odd {kind}")
        for sample in family.samples:
            if kind == "counter" and sample.name != f"{name}_total":
                faults.append(f"{sample.name}: a counter that is no total")
            faults += [
                f"{name}: label {label}"
                for label in sample.labels
                if not re.fullmatch("[a-z][a-z_]*", label) or label in {"instance", "job"}
            ]
    return faults


def own(families: Iterable[Metric]) -> list[Metric]:
    return [family for family in families if not family.name.startswith(STANDARD)]


def exchange(**changes: Any) -> Any:
    """A request that is over."""
    usual = {
        "route": "/edit", "method": "POST", "status": 200, "seconds": 0.3, "receiving": 0.1,
        "request_bytes": 100, "response_bytes": 200, "code": "", "report": {},
        "record": Record(), "identity": Identity("a" * 32, "r"),
    }  # fmt: skip
    return SimpleNamespace(**usual | changes)


def test_names_keep_to_the_conventions(pretend_app: Any) -> None:
    registry = pretend_app().state.context.metrics.registry
    assert lint(own(registry.collect())) == []


def test_each_app_has_its_own(pretend_app: Any) -> None:
    one, other = (pretend_app().state.context.metrics for _ in range(2))
    one.count(exchange())
    name, labels = f"{PREFIX}_request_duration_seconds_count", {
        "route": "/edit", "method": "POST", "status": "200",
    }  # fmt: skip
    assert one.registry.get_sample_value(name, labels) == 1
    assert other.registry.get_sample_value(name, labels) is None


def test_stages_are_there_before_there_was_any() -> None:
    metrics = Metrics()
    for stage in STAGES:
        value = metrics.registry.get_sample_value(
            f"{PREFIX}_stage_duration_seconds_count", {"stage": stage}
        )
        assert value == 0


def test_a_stage_counts_once_a_request() -> None:
    record = Record()
    record.add("bind", 0.0, 0.2)
    record.add("bind", 1.0, 0.3)
    metrics = Metrics()
    metrics.count(exchange(record=record))
    for suffix, expected in (("count", 1), ("sum", 0.5)):
        value = metrics.registry.get_sample_value(
            f"{PREFIX}_stage_duration_seconds_{suffix}", {"stage": "bind"}
        )
        assert value == expected


def test_problems_are_counted_by_code() -> None:
    metrics = Metrics()
    metrics.count(exchange(status=429, code="overloaded"))
    metrics.count(exchange())
    (family,) = (f for f in metrics.registry.collect() if f.name == f"{PREFIX}_problems")
    assert [(s.labels, s.value) for s in family.samples] == [({"code": "overloaded"}, 1)]


def test_what_was_inferred_and_edited_is_counted_by_category() -> None:
    metrics = Metrics()
    for known in (True, False, True):
        report = {"category": "chair", "fit": {"in_distribution": known}}
        metrics.count(exchange(route="/infer", report=report))
    edit = {"category": "human", "flipped_faces": 7, "warnings": ["a", "b"]}
    metrics.count(exchange(report=edit))

    def value(name: str, **labels: str) -> float | None:
        return metrics.registry.get_sample_value(f"{PREFIX}_{name}_total", labels)

    assert value("inferences", category="chair", in_distribution="true") == 2
    assert value("inferences", category="chair", in_distribution="false") == 1
    assert value("edits", category="human") == 1
    assert value("flipped_faces", category="human") == 7
    assert value("edit_warnings", category="human") == 2
    assert value("edits", category="chair") is None


def test_buckets_of_bytes_end_where_uploads_do() -> None:
    assert BYTE_BUCKETS[0] == 1024
    assert BYTE_BUCKETS[-1] == 128 * 1024 * 1024
    assert list(BYTE_BUCKETS) == sorted(set(BYTE_BUCKETS))


def test_odd_requests_make_few_series(pretend_app: Any, serve: Any) -> None:
    app: FastAPI = pretend_app()
    client: httpx.Client = serve(app)
    known = {*app.openapi()["paths"], "/", "/web/{path:path}", "/docs", "/openapi.json"}
    for number in range(20):
        for path in ("/", "/web/a", "/meshes/a", "/categories/a", "/%E2%80%A8%0A", "/edit"):
            client.request(f"M{number}", f"{path}{number}", headers={"X-Odd": f"{number}"})
            client.get(f"{path}{number}?q={number}")
    for family in text_string_to_metric_families(client.get("/metrics").text):
        for sample in family.samples:
            assert sample.labels.get("route", "unmatched") in known | {"unmatched"}
            assert sample.labels.get("method", "other") in {"GET", "other"}
            assert sample.labels.get("code", "not_found") in {
                "mesh_id_unknown", "method_not_allowed", "not_found", "unknown_category",
            }  # fmt: skip


def test_the_server_tells_of_connections_and_of_what_it_refuses(pretend_app: Any) -> None:
    app: FastAPI = pretend_app()
    registry = app.state.context.metrics.registry
    server = Server(Config(app, Settings()), app.state.context)
    (listener,) = listen("127.0.0.1", 0)
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    try:
        with socket.create_connection(listener.getsockname(), timeout=20) as connection:
            connection.sendall(b"nonsense\r\n\r\n")
            assert connection.recv(4096).startswith(b"HTTP/1.1 400 ")
            assert registry.get_sample_value(f"{PREFIX}_connections") == 1
    finally:
        server.should_exit = True
        thread.join()
    refused = {"code": "http_malformed"}
    assert registry.get_sample_value(f"{PREFIX}_problems_total", refused) == 1
    assert registry.get_sample_value(f"{PREFIX}_connections") == 0
