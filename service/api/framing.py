"""How long a request says that its body is; one that says it twice is refused."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.problems import Problem


def declared_bytes(headers: Headers) -> int:
    """Bytes of the body, as far as the head tells."""
    declared = headers.get("content-length", "")
    return int(declared) if declared.isdecimal() else 0


class Framing:
    """Middleware: refuses what has both a Content-Length and a Transfer-Encoding, and hangs up.

    Proxies and servers may choose differently between them, and so one client can put another's
    words into a connection that a proxy shares between them (request smuggling; RFC 9112, section
    6.1).
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            headers = Headers(scope=scope)
            if "content-length" in headers and "transfer-encoding" in headers:
                problem = Problem(
                    400,
                    "length_ambiguous",
                    "The request has both a Content-Length and a Transfer-Encoding.",
                    "Send one of them; a proxy in between should not pass on both.",
                    scope["state"]["trace_id"],
                    {"Connection": "close"},
                )
                await problem(scope, receive, send)
                return
        await self.app(scope, receive, send)
