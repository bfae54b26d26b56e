from __future__ import annotations

import json
from typing import Any

import httpx
import pytest
from wire import closes, connected, reply

NEXT = b"GET /livez HTTP/1.1\r\nHost: wire\r\n\r\n"


@pytest.mark.parametrize("path", ["/infer", "/livez", "/nowhere"])
@pytest.mark.parametrize("swapped", [False, True])
def test_no_request_hides_in_the_body_of_another(
    client: httpx.Client, pretend: Any, path: str, swapped: bool
) -> None:
    lengths = [b"Content-Length: 4\r\n", b"Transfer-Encoding: chunked\r\n"]
    if swapped:
        lengths.reverse()
    head = f"POST {path} HTTP/1.1\r\nHost: wire\r\n".encode() + b"".join(lengths) + b"\r\n"
    with connected(client.base_url.port or 0) as connection:
        connection.sendall(head + b"0\r\n\r\n" + NEXT)
        answer = reply(connection)
        assert answer.status == 400
        assert json.loads(answer.body)["code"] == "length_ambiguous"
        assert answer.headers["connection"] == "close"
        assert closes(connection), "the next request was answered"
    assert not pretend.calls


@pytest.mark.parametrize("length", ["Content-Length: 0", "Transfer-Encoding: chunked"])
def test_one_length_is_fine(client: httpx.Client, length: str) -> None:
    end = b"0\r\n\r\n" if "chunked" in length else b""
    with connected(client.base_url.port or 0) as connection:
        head = f"POST /infer HTTP/1.1\r\nHost: wire\r\n{length}\r\n\r\n".encode()
        connection.sendall(head + end)
        assert reply(connection).status == 422
