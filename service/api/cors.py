"""Which pages of other origins a browser lets call: none, unless the operator names them."""

from __future__ import annotations

from collections.abc import Collection

from starlette.datastructures import Headers
from starlette.middleware.cors import CORSMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.problems import Problem

METHODS = ("DELETE", "GET", "HEAD", "POST")
REQUEST_HEADERS = (
    "Authorization",
    "Idempotency-Key",
    "If-None-Match",
    "Last-Event-ID",
    "Prefer",
    "X-API-Key",
    "X-Request-Id",
    "traceparent",
    "tracestate",
)
ANSWER_HEADERS = (
    "Content-Disposition",
    "ETag",
    "Location",
    "Preference-Applied",
    "Retry-After",
    "Server-Timing",
    "Shape-Parameters",
    "Trace-Id",
    "WWW-Authenticate",
    "X-Request-Id",
)
# Seconds that a browser keeps the answer to a preflight; none keeps it for longer.
MAX_AGE = 7200


class Cors(CORSMiddleware):
    """Middleware: starlette's, whose refusals are problems too.

    Cookies and the like are never asked for: a key is sent by the page's own code.
    """

    def __init__(self, app: ASGIApp, origins: Collection[str]) -> None:
        super().__init__(
            app,
            allow_origins=origins,
            allow_methods=METHODS,
            allow_headers=REQUEST_HEADERS,
            expose_headers=ANSWER_HEADERS,
            max_age=MAX_AGE,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] == "OPTIONS":
            asked = Headers(scope=scope)
            if "origin" in asked and "access-control-request-method" in asked:
                answer = self.preflight_response(asked)
                if answer.status_code >= 400:
                    refused = bytes(answer.body).decode().removeprefix("Disallowed CORS ")
                    answer = Problem(
                        400,
                        "cors_refused",
                        f"A page of {asked['origin'][:80]!r} may not make this call: {refused}.",
                        "CORS_ORIGINS lets origins in; methods are GET, POST, DELETE.",
                        scope["state"]["trace_id"],
                        {"Vary": answer.headers["vary"]},
                    )
                await answer(scope, receive, send)
                return
        await super().__call__(scope, receive, send)
