"""What is seen of each request from outside: ids, measurements, its line in the log."""

from __future__ import annotations

import logging
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service import logs
from service.api import tracing
from service.api.exchange import Exchange
from service.api.metrics import Metrics
from service.api.routes import PROBES, Routes
from service.api.trace import REQUEST_HEADER, request_id, trace_id

LONGEST_PATH = 200
LONGEST_AGENT = 120

logger = logging.getLogger("service.access")


class Observe:
    """Middleware, the outermost: gives a request its ids and its record, and tells how it went.

    Sets ``request.state.trace_id``, ``request_id`` and ``record``; routes may set ``report``.
    Answers name the ids, and what the time went into, in `Trace-Id`, `X-Request-Id` and
    `Server-Timing`.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, routes: Routes) -> None:
        self.app = app
        self.metrics = metrics
        self.routes = routes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        identity = _identity(scope, headers)
        route = self.routes.template(scope["path"])
        exchange = Exchange(scope, receive, send, identity, route)
        with logs.about(identity), self.metrics.open():
            try:
                await self.app(scope, exchange.receive, exchange.send)
            except BaseException:
                exchange.fail()
                raise
            finally:
                self.metrics.count(exchange)
                if identity.sampled:
                    tracing.add_stages(exchange.record)
                _log(exchange, scope, headers)


def _identity(scope: Scope, headers: Headers) -> logs.Identity:
    own = request_id(headers.get(REQUEST_HEADER))
    traced = tracing.identity(own)
    if traced is None:
        return logs.Identity(trace_id(headers.get("traceparent")), own)
    tracing.describe(scope, own)
    return traced


def _log(exchange: Exchange, scope: Scope, headers: Headers) -> None:
    level = logging.DEBUG if exchange.route in PROBES else logging.INFO
    if not logger.isEnabledFor(level):
        return
    path = logs.plain(exchange.path, LONGEST_PATH)
    client = scope.get("client")
    stages = exchange.record.seconds
    fields: dict[str, Any] = {
        "method": exchange.method,
        "route": exchange.route,
        "path": path,
        "status": exchange.status,
        "code": exchange.code,
        "duration_seconds": round(exchange.seconds, 6),
        "receive_seconds": exchange.receiving and round(exchange.receiving, 6),
        "request_bytes": exchange.request_bytes,
        "response_bytes": exchange.response_bytes,
        "stage_seconds": {name: round(value, 6) for name, value in stages.items()},
        "category": exchange.report.get("category"),
        "owner": exchange.owner,
        "client": client[0] if client else "",
        "user_agent": logs.plain(headers.get("user-agent", ""), LONGEST_AGENT),
    }
    told = {name: value for name, value in fields.items() if value not in ("", None, {})}
    logger.log(
        level,
        "%s %s %d%s in %.0f ms",
        exchange.method,
        path,
        exchange.status,
        exchange.code and f" {exchange.code}",
        1e3 * exchange.seconds,
        extra={logs.FIELDS: told},
    )
