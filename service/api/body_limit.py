"""The largest request body, and the slowest: told by Content-Length, or found out as it streams."""

from __future__ import annotations

import time

from anyio import move_on_after
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.framing import declared_bytes
from service.api.left import ClientLeft
from service.api.problems import from_http

RATE = 1024
"""Bytes a second that a body must come at."""


class BodyLimit:
    """Middleware: a body of more than `limit` bytes is a 413, one that dawdles a 408.

    One that declares its length is refused at once.  Else the error is raised where the body is
    read: as an HTTPException it passes through the framework's form parser as it is and reaches
    the same handler as every other problem.
    """

    def __init__(self, app: ASGIApp, limit: int, seconds: float) -> None:
        """`seconds` is for each ``RATE * seconds`` bytes of the body, or its rest."""
        self.app = app
        self.limit = limit
        self.seconds = seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        if declared_bytes(Headers(scope=scope)) > self.limit:
            problem = from_http(scope, self._too_large())
            await problem(scope, receive, send)
            return
        whole = False
        received = 0
        stretch = 0
        end = time.monotonic() + self.seconds

        async def limited() -> Message:
            nonlocal whole, received, stretch, end
            if whole:
                return await receive()
            message: Message | None = None
            with move_on_after(end - time.monotonic()):
                message = await receive()
            if message is None:
                raise self._too_slow(received)
            if message["type"] == "http.disconnect":
                raise ClientLeft
            came = len(message.get("body", b""))
            received += came
            if received > self.limit:
                raise self._too_large()
            stretch += came
            if stretch >= RATE * self.seconds:
                stretch, end = 0, time.monotonic() + self.seconds
            whole = not message.get("more_body", False)
            return message

        await self.app(scope, limited, send)

    def _too_large(self) -> HTTPException:
        return HTTPException(413, f"The request's body is over the limit of {self.limit} bytes.")

    def _too_slow(self, received: int) -> HTTPException:
        return HTTPException(
            408,
            f"{received} bytes of the body had come, and too few in the last {self.seconds:g} s.",
        )
