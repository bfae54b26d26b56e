"""OpenTelemetry traces, by the framework's own support: a span a request, a child a stage.

Without a provider of spans nothing here runs but the one look of `identity`.  One is made when the
server starts and `OTEL_EXPORTER_OTLP_ENDPOINT` is set, or by whoever embeds the app.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from importlib.metadata import version
from typing import Any

from fastapi.telemetry import TelemetryConfig
from opentelemetry import trace
from starlette.types import Scope

from service.api.routes import PROBES
from service.logs import Identity
from service.stages import Record

SERVICE_NAME = "shape-parameters"


def _is_probe(scope: MutableMapping[str, Any]) -> bool:
    return scope.get("path") in PROBES


TELEMETRY: TelemetryConfig = {
    "auto_configure": True,
    # They hold the messages of exceptions and the input that is not valid: clients' own data.
    "logs": False,
    # Prometheus has them, of stages too.
    "metrics": False,
    # A span for each dependency of each route tells an operator little.
    "operation_spans": False,
    "exclude": _is_probe,
}


_TRACER = "shape-parameters", version("shape-parameters")


def identity(request_id: str) -> Identity | None:
    """Ids of the request, whose span is current; None where nothing is traced."""
    span = trace.get_current_span()
    context = span.get_span_context()
    if not context.is_valid:
        return None
    span_id = trace.format_span_id(context.span_id) if context.trace_flags.sampled else ""
    return Identity(trace.format_trace_id(context.trace_id), request_id, span_id)


def describe(scope: Scope, request_id: str) -> None:
    """Add to the request's span, which is current, what the framework doesn't tell of it."""
    span = trace.get_current_span()
    span.set_attribute("shape_parameters.request_id", request_id)
    # The service reads no query, but a client may have put a secret there.
    if scope.get("query_string"):
        span.set_attribute("url.query", "REDACTED")


def add_stages(record: Record) -> None:
    """Add the stages of a request to its span, which is current, though it may have ended."""
    tracer = trace.get_tracer(*_TRACER, TELEMETRY.get("tracer_provider"))
    for interval in record.intervals:
        span = tracer.start_span(interval.stage, start_time=_nanoseconds(interval.start))
        span.end(_nanoseconds(interval.start + interval.whole))


def set_defaults() -> None:
    """Give the environment the service's name and its patience, where it says nothing of them."""
    if "service.name=" not in os.environ.get("OTEL_RESOURCE_ATTRIBUTES", ""):
        os.environ.setdefault("OTEL_SERVICE_NAME", SERVICE_NAME)
    # In seconds: a collector that is gone holds the end of the process up so long.
    os.environ.setdefault("OTEL_EXPORTER_OTLP_TIMEOUT", "3")


def _nanoseconds(seconds: float) -> int:
    return int(seconds * 1e9)
