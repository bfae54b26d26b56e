from __future__ import annotations

from typing import Any

import anyio
import pytest

from service.api.pieces import SIZE, Pieces


def sent(*bodies: bytes) -> list[dict[str, Any]]:
    messages: list[dict[str, Any]] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for number, body in enumerate(bodies, 1):
            more = number < len(bodies)
            await send({"type": "http.response.body", "body": body, "more_body": more})

    async def send(message: Any) -> None:
        messages.append(message)

    async def nothing() -> Any:
        raise AssertionError

    anyio.run(Pieces(app), {"type": "http"}, nothing, send)
    return messages


@pytest.mark.parametrize("size", [0, 1, SIZE - 1, SIZE, SIZE + 1, 3 * SIZE, 3 * SIZE + 7])
def test_a_body_comes_whole_in_pieces(size: int) -> None:
    body = bytes(range(256)) * (size // 256 + 1)
    start, *rest = sent(body[:size])
    assert start["type"] == "http.response.start"
    assert b"".join(message["body"] for message in rest) == body[:size]
    assert all(len(message["body"]) <= SIZE for message in rest)
    assert [message.get("more_body", False) for message in rest] == [True] * (len(rest) - 1) + [
        False
    ]
    assert len(rest) == max(1, -(-size // SIZE))


def test_a_body_that_streams_ends_once() -> None:
    _, *rest = sent(b"a" * (SIZE + 1), b"b", b"")
    assert b"".join(message["body"] for message in rest) == b"a" * (SIZE + 1) + b"b"
    assert [message.get("more_body", False) for message in rest] == [True, True, True, False]
