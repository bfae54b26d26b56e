"""Answers that come before the request's body has: sent so that the client can read them.

A connection that is closed while bytes of the body are on their way is reset, and a reset makes
clients lose the answer.  So what still comes is taken and thrown away, for a while.
"""

from __future__ import annotations

from anyio import move_on_after
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.framing import declared_bytes

PATIENCE_S = 2.0
"""How long the rest of a body is waited for, in seconds."""

MOST = 16 * 1024 * 1024
"""How much of it is taken, in bytes."""

SMALL = 64 * 1024
"""A body of up to so many bytes is taken to its end, so that the connection can be kept."""


class Linger:
    """Middleware: an answer that leaves its request's body unread says `Connection: close`.

    It goes out whole at once; its end is told to the server, which then closes, once the body has
    ended, the client has left, or there was enough of it.  A client that asks before it sends
    (`Expect: 100-continue`) is not told to.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        length = declared_bytes(headers)
        unread = length > 0 or "transfer-encoding" in headers
        small = 0 < length <= SMALL

        async def noted() -> Message:
            nonlocal unread
            message = await receive()
            unread = unread and message.get("more_body", False)
            return message

        async def answer(message: Message) -> None:
            if unread:
                if message["type"] == "http.response.start" and not small:
                    MutableHeaders(scope=message)["Connection"] = "close"
                if message["type"] == "http.response.body" and not message.get("more_body", False):
                    await send({**message, "more_body": True})
                    await discard()
                    message = {"type": "http.response.body", "body": b""}
            await send(message)

        async def discard() -> None:
            taken = 0
            with move_on_after(PATIENCE_S):
                while unread and taken < MOST:
                    taken += len((await noted()).get("body", b""))

        await self.app(scope, noted, answer)
