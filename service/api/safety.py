"""Headers that keep browsers from doing harm with an answer."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
    # Of loads without CORS only: pages that CORS_ORIGINS lets in are not held up by it.
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""What every answer has, unless its route says otherwise."""


def protect(headers: MutableHeaders, status: int) -> None:
    """Add `HEADERS` to an answer's, and keep caches from answering in the service's place."""
    for name, value in HEADERS.items():
        headers.setdefault(name, value)
    # An answer may hang on a key, and an error on the moment.
    headers.setdefault("Cache-Control", "no-store" if status >= 400 else "no-cache")


class SafetyHeaders:
    """Middleware: lets no answer go without."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def safe(message: Message) -> None:
            if message["type"] == "http.response.start":
                protect(MutableHeaders(scope=message), message["status"])
            await send(message)

        await self.app(scope, receive, safe if scope["type"] == "http" else send)
