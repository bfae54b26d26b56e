"""One id a request, from its `traceparent` (W3C Trace Context) or fresh, in every answer."""

from __future__ import annotations

import logging
import re
import secrets

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.problems import internal_error

HEADER = "Trace-Id"

logger = logging.getLogger(__name__)

# Later versions may append fields; version 00 has exactly four.
_TRACEPARENT = re.compile(
    "(?P<version>[0-9a-f]{2})-(?P<trace>[0-9a-f]{32})-(?P<parent>[0-9a-f]{16})-[0-9a-f]{2}"
    "(?P<rest>-.*)?"
)


def trace_id(traceparent: str | None) -> str:
    """32 hex digits: the header's trace id where it is valid, else fresh ones."""
    match = _TRACEPARENT.fullmatch(traceparent.strip()) if traceparent else None
    if match and _valid(match):
        return match["trace"]
    return secrets.token_hex(16)


def _valid(match: re.Match[str]) -> bool:
    version = match["version"]
    return (
        version != "ff"
        and int(match["trace"], 16) != 0
        and int(match["parent"], 16) != 0
        and not (version == "00" and match["rest"])
    )


class Trace:
    """Middleware: sets ``request.state.trace_id``, names it in the answer, and catches the rest.

    An error that no handler knows is logged with its trace id and answered with a 500 problem
    that tells nothing of the inside.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        identity = trace_id(Headers(scope=scope).get("traceparent"))
        scope.setdefault("state", {})["trace_id"] = identity
        started = False

        async def traced(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                MutableHeaders(scope=message)[HEADER] = identity
            await send(message)

        try:
            await self.app(scope, receive, traced)
        except Exception:
            logger.exception("%s %s failed, trace %s", scope["method"], scope["path"], identity)
            if started:
                raise
            await internal_error(identity)(scope, receive, traced)
