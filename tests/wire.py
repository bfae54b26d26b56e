"""HTTP by hand: for clients that do what no client library would."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.client import HTTPResponse
from typing import Any

PATIENCE_S = 20.0


@dataclass(frozen=True)
class Reply:
    """An answer, read to its end."""

    status: int
    headers: dict[str, str]
    body: bytes


@contextmanager
def connected(port: int) -> Iterator[socket.socket]:
    """A connection to a server on this machine."""
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as connection:
        yield connection


def head(path: str, method: str = "POST", **headers: Any) -> bytes:
    """The head of a request; underlines in names are hyphens."""
    lines = [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    return "\r\n".join([f"{method} {path} HTTP/1.1", "Host: wire", *lines, "", ""]).encode()


def reply(connection: socket.socket) -> Reply:
    """The next answer on a connection."""
    response = HTTPResponse(connection)
    response.begin()
    headers = {name.lower(): value for name, value in response.getheaders()}
    return Reply(response.status, headers, response.read())


def closes(connection: socket.socket) -> bool:
    """Whether the server closes the connection without a further byte."""
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True


def until(happens: Callable[[], bool]) -> None:
    """Wait for something to be so; AssertionError when it never is."""
    end = time.monotonic() + PATIENCE_S
    while not happens():
        assert time.monotonic() < end, "it never was so"
        time.sleep(0.002)
