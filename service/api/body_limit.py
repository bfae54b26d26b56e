"""The largest request body: told by Content-Length, or found out while it streams."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send


class BodyLimit:
    """Middleware: reading a body of more than `limit` bytes raises a 413 HTTPException.

    Raised where the body is read, it passes through the framework's form parser as it is and
    reaches the same handler as every other problem.
    """

    def __init__(self, app: ASGIApp, limit: int) -> None:
        self.app = app
        self.limit = limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        declared = Headers(scope=scope).get("content-length", "")
        total = int(declared) if declared.isdecimal() else 0
        too_large = total > self.limit
        received = 0

        async def limited() -> Message:
            nonlocal received
            if too_large:
                raise self._error()
            message = await receive()
            received += len(message.get("body", b""))
            if received > self.limit:
                raise self._error()
            return message

        await self.app(scope, limited, send)

    def _error(self) -> HTTPException:
        return HTTPException(413, f"The request's body is over the limit of {self.limit} bytes.")
