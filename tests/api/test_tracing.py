from __future__ import annotations

import gzip
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.sdk.trace import ReadableSpan, TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.sdk.trace.sampling import ALWAYS_OFF

from service import stages
from service.api import tracing

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = "00f067aa0ba902b7"
MESH = {"mesh": ("private-name.obj", b"v 0 0 0 private-data")}


@pytest.fixture
def spans(monkeypatch: pytest.MonkeyPatch) -> InMemorySpanExporter:
    """Where the spans go of an app that is made from now on."""
    exporter = InMemorySpanExporter()
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(exporter))
    monkeypatch.setitem(tracing.TELEMETRY, "tracer_provider", provider)
    return exporter


@pytest.fixture
def traced(
    spans: InMemorySpanExporter, pretend_app: Callable[..., FastAPI], pretend: Any, serve: Any
) -> Iterator[httpx.Client]:
    """A client of a service whose requests are traced; its work has two stages."""

    def work() -> None:
        with stages.stage("encode"), stages.stage("refine"):
            pass

    pretend.work = work
    return serve(pretend_app())


def _spans(exporter: InMemorySpanExporter, *names: str) -> list[ReadableSpan]:
    """All spans, once these have ended: which is after the client has its answer."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        spans = list(exporter.get_finished_spans())
        missing = list(names)
        for span in spans:
            if span.name in missing:
                missing.remove(span.name)
        if not missing:
            return spans
        time.sleep(0.002)
    pytest.fail(f"no spans of {missing}")


def test_a_request_is_a_span_and_its_stages_are_children(
    traced: httpx.Client, spans: InMemorySpanExporter
) -> None:
    answer = traced.post("/infer", files=MESH, headers={"traceparent": f"00-{TRACE}-{PARENT}-01"})
    assert answer.status_code == 200
    found = {span.name: span for span in _spans(spans, "POST /infer", "encode", "refine")}
    request = found.pop("POST /infer")
    assert request.parent is not None
    assert f"{request.parent.span_id:016x}" == PARENT
    assert f"{request.context.trace_id:032x}" == TRACE == answer.headers["trace-id"]
    assert request.attributes is not None
    assert request.attributes["http.response.status_code"] == 200
    assert request.attributes["shape_parameters.request_id"] == answer.headers["x-request-id"]
    assert set(found) <= set(stages.STAGES)
    for span in found.values():
        assert span.parent is not None
        assert span.parent.span_id == request.context.span_id
        assert request.start_time is not None
        assert span.start_time is not None
        assert span.end_time is not None
        # Two clocks tell when; a millisecond is between them at most.
        assert request.start_time - 10**6 <= span.start_time <= span.end_time
    outer, inner = found["encode"], found["refine"]
    assert outer.start_time is not None
    assert inner.start_time is not None
    assert outer.start_time <= inner.start_time


def test_without_a_parent_the_trace_is_a_new_one(
    traced: httpx.Client, spans: InMemorySpanExporter
) -> None:
    answer = traced.get("/categories", headers={"traceparent": "nonsense"})
    (span,) = _spans(spans, "GET /categories")
    assert f"{span.context.trace_id:032x}" == answer.headers["trace-id"]
    assert span.parent is None


def test_nothing_of_the_clients_is_in_a_span(
    traced: httpx.Client, spans: InMemorySpanExporter, pretend: Any
) -> None:
    traced.post("/infer?api_key=private-key", files=MESH)
    traced.post("/infer", data={"category": "private-field", "mesh": "private-mesh"})

    def fail() -> None:
        raise RuntimeError("private-words")

    pretend.work = fail
    assert traced.post("/infer", files=MESH).status_code == 500
    told = "".join(span.to_json() for span in _spans(spans, *["POST /infer"] * 3))
    assert "private" not in told


def test_probes_leave_no_span(traced: httpx.Client, spans: InMemorySpanExporter) -> None:
    for path in ("/livez", "/readyz", "/metrics"):
        answer = traced.get(path, headers={"traceparent": f"00-{TRACE}-{PARENT}-01"})
        assert answer.headers["trace-id"] == TRACE
    assert not spans.get_finished_spans()


def test_a_trace_that_is_not_kept_has_an_id_all_the_same(
    monkeypatch: pytest.MonkeyPatch, pretend_app: Callable[..., FastAPI], serve: Any
) -> None:
    exporter = InMemorySpanExporter()
    provider = TracerProvider(sampler=ALWAYS_OFF, shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(exporter))
    monkeypatch.setitem(tracing.TELEMETRY, "tracer_provider", provider)
    client = serve(pretend_app())
    answer = client.get("/categories", headers={"traceparent": f"00-{TRACE}-{PARENT}-00"})
    assert answer.headers["trace-id"] == TRACE
    assert not exporter.get_finished_spans()


def test_a_bucket_names_a_trace_that_is_kept(traced: httpx.Client) -> None:
    answer = traced.post("/infer", files=MESH)
    text = traced.get("/metrics", headers={"Accept": "application/openmetrics-text"}).text
    assert f'trace_id="{answer.headers["trace-id"]}"' in text


def test_no_sdk_is_loaded_where_nothing_is_traced() -> None:
    code = (
        "import sys; from service.main import create_app; create_app();"
        "print('opentelemetry.sdk' in sys.modules)"
    )
    environment = {k: v for k, v in os.environ.items() if not k.startswith("OTEL")}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert done.stdout == "False\n"


class Collector(ThreadingHTTPServer):
    """Takes what comes by OTLP over HTTP."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Take)
        self.bodies: list[tuple[str, bytes]] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"


class _Take(BaseHTTPRequestHandler):
    server: Collector

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["content-length"]))
        if self.headers.get("content-encoding") == "gzip":
            body = gzip.decompress(body)
        self.server.bodies.append((self.path, body))
        self.send_response(200)
        self.end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        pass


@pytest.fixture
def collector() -> Iterator[Collector]:
    with Collector() as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def test_the_usual_variable_is_enough(collector: Collector) -> None:
    environment = {
        **os.environ,
        "CATEGORIES": "debug",
        "OTEL_EXPORTER_OTLP_ENDPOINT": collector.url,
        "PORT": "0",
        "NO_PROXY": "127.0.0.1",
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "service"], env=environment, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stderr is not None
        lines = (re.search(r"running on (http://[0-9.:]+)", line) for line in process.stderr)
        url = next(match[1] for match in lines if match)
        answer = httpx.get(f"{url}/categories", trust_env=False, timeout=60)
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    ((path, body),) = collector.bodies
    assert path == "/v1/traces"
    (told,) = ExportTraceServiceRequest.FromString(body).resource_spans
    named = {entry.key: entry.value.string_value for entry in told.resource.attributes}
    assert named["service.name"] == "shape-parameters"
    (span,) = (span for scope in told.scope_spans for span in scope.spans)
    assert span.name == "GET /categories"
    assert span.trace_id.hex() == answer.headers["trace-id"]


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({}, "shape-parameters"),
        ({"OTEL_SERVICE_NAME": "mine"}, "mine"),
        ({"OTEL_RESOURCE_ATTRIBUTES": "team=a,service.name=mine"}, None),
    ],
)
def test_the_environment_goes_before_the_defaults(
    monkeypatch: pytest.MonkeyPatch, given: dict[str, str], name: str | None
) -> None:
    monkeypatch.setattr(os, "environ", dict(given))
    tracing.set_defaults()
    assert os.environ.get("OTEL_SERVICE_NAME") == name
    assert os.environ["OTEL_EXPORTER_OTLP_TIMEOUT"] == "3"
