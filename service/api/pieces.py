"""Large answers in pieces, as fast as the client takes them."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send

SIZE = 256 * 1024
"""Of a piece, in bytes."""


class Pieces:
    """Middleware: a body that is sent at once goes to the server in pieces.

    What a client is slow to take would be copied whole into its connection's buffer otherwise, on
    the event loop.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def piecewise(message: Message) -> None:
            body = message.get("body", b"")
            if message["type"] == "http.response.body" and len(body) > SIZE:
                for start in range(0, len(body) - SIZE, SIZE):
                    piece = body[start : start + SIZE]
                    await send({"type": message["type"], "body": piece, "more_body": True})
                message = {**message, "body": body[-(len(body) % SIZE or SIZE) :]}
            await send(message)

        await self.app(scope, receive, piecewise if scope["type"] == "http" else send)
