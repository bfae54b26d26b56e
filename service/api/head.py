"""HEAD, for every path that answers GET."""

from __future__ import annotations

from starlette.types import ASGIApp, Receive, Scope, Send


class Head:
    """Middleware: HEAD is routed as GET; the server leaves the answer's body out."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] == "HEAD":
            scope = {**scope, "method": "GET"}
            scope.setdefault("state", {})["head"] = True
        await self.app(scope, receive, send)
