"""What is counted and timed as requests go by, in the terms of Prometheus.

Labels take few values, none of a client's making.  What the service merely holds is not here: it
is read when the metrics are asked for, by `Mirror`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    GCCollector,
    Histogram,
    PlatformCollector,
    ProcessCollector,
    disable_created_metrics,
)

from service.api.exchange import Exchange
from service.stages import STAGES

PREFIX = "shape_parameters"

REQUEST_BUCKETS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30)
"""Seconds: an answer from a cache to the longest that one may take by default."""
STAGE_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10)
BYTE_BUCKETS = (*(2.0**power for power in range(10, 28, 2)), 2.0**27)
"""1 KiB to 64 MiB in steps of four, and the largest upload by default."""


class Metrics:
    """The instruments of one app, in a registry of its own.

    Attributes:
        connections: a gauge that the server has look at its own.
    """

    def __init__(self) -> None:
        # When each series began: doubles the series, and nothing asks for it.
        disable_created_metrics()  # type: ignore[no-untyped-call]
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        PlatformCollector(registry=self.registry)
        GCCollector(registry=self.registry)
        self._duration = self._histogram(
            "request_duration_seconds",
            "From a request's headers to the end of its answer.",
            REQUEST_BUCKETS,
            "route",
            "method",
            "status",
        )
        self._receiving = self._histogram(
            "request_receive_seconds",
            "From a request's headers to the end of its body: how slow the client sends.",
            REQUEST_BUCKETS,
        )
        self._stages = self._histogram(
            "stage_duration_seconds", "Of each request, on a stage.", STAGE_BUCKETS, "stage"
        )
        self._request_bytes = self._histogram(
            "request_body_bytes", "Bodies of requests, as far as read.", BYTE_BUCKETS, "route"
        )
        self._response_bytes = self._histogram(
            "response_body_bytes", "Bodies of answers, as far as sent.", BYTE_BUCKETS, "route"
        )
        self._open = Gauge(
            f"{PREFIX}_open_requests",
            "Requests that have come and are not answered, those that are still sent included.",
            registry=self.registry,
        )
        self.connections = Gauge(
            f"{PREFIX}_connections",
            "Connections that are open, idle ones included.",
            registry=self.registry,
        )
        self._problems = self._counter("problems", "Answers that are problems.", "code")
        self._inferences = self._counter(
            "inferences", "Meshes inferred by /infer.", "category", "in_distribution"
        )
        self._edits = self._counter("edits", "Meshes edited by /edit and /transfer.", "category")
        self._flips = self._counter("flipped_faces", "Faces that edits turned over.", "category")
        self._warnings = self._counter("edit_warnings", "Warnings in reports of edits.", "category")
        for stage in STAGES:
            self._stages.labels(stage)

    def _histogram(
        self, name: str, help: str, buckets: tuple[float, ...], *labels: str
    ) -> Histogram:
        return Histogram(f"{PREFIX}_{name}", help, labels, buckets=buckets, registry=self.registry)

    def _counter(self, name: str, help: str, *labels: str) -> Counter:
        return Counter(f"{PREFIX}_{name}", help, labels, registry=self.registry)

    @contextmanager
    def open(self) -> Iterator[None]:
        """A request is open within the block."""
        self._open.inc()
        try:
            yield
        finally:
            self._open.dec()

    def count(self, exchange: Exchange) -> None:
        """A request is over."""
        route, identity = exchange.route, exchange.identity
        # In OpenMetrics a bucket names a trace of its own, where that is kept.
        exemplar = {"trace_id": identity.trace_id} if identity.sampled else None
        labels = (route, exchange.method, str(exchange.status))
        self._duration.labels(*labels).observe(exchange.seconds, exemplar)
        for stage, seconds in exchange.record.seconds.items():
            self._stages.labels(stage).observe(seconds, exemplar)
        if exchange.receiving is not None and exchange.request_bytes:
            self._receiving.observe(exchange.receiving)
        self._request_bytes.labels(route).observe(exchange.request_bytes)
        self._response_bytes.labels(route).observe(exchange.response_bytes)
        if exchange.code:
            self._problems.labels(exchange.code).inc()
        self._count_report(exchange.report)

    def refuse(self, code: str) -> None:
        """A connection was answered by the server, in place of the app, with a problem."""
        self._problems.labels(code).inc()

    def _count_report(self, report: Mapping[str, Any]) -> None:
        if "fit" in report:
            known = "true" if report["fit"]["in_distribution"] else "false"
            self._inferences.labels(report["category"], known).inc()
        if "flipped_faces" in report:
            category = report["category"]
            self._edits.labels(category).inc()
            self._flips.labels(category).inc(report["flipped_faces"])
            self._warnings.labels(category).inc(len(report["warnings"]))
