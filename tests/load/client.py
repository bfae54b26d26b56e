"""An HTTP client that takes little of the CPUs: one connection, bytes out, bytes in."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import urlencode

BOUNDARY = "a-part-of-the-load"
MULTIPART = f"multipart/form-data; boundary={BOUNDARY}"
# Of what is read ahead: with less, a large answer wakes the client hundreds of times.
LIMIT = 16 << 20

# What the exporter of the meshes names itself by.
GENERATOR = b"https://github.com/mikedh/trimesh"
URLENCODED = "application/x-www-form-urlencoded"


@dataclass(frozen=True)
class Call:
    """A request, ready to be sent; `name` groups what is measured."""

    name: str
    method: str
    path: str
    body: bytes = b""
    content_type: str = ""

    def numbered(self, number: int) -> Call:
        """The call with a number in its mesh: one that the service has never seen."""
        body = self.body.replace(GENERATOR, b"%0*d" % (len(GENERATOR), number))
        return replace(self, body=body)

    def bytes(self) -> bytes:
        """As it goes over the wire."""
        kind = f"Content-Type: {self.content_type}\r\n" if self.content_type else ""
        head = f"{self.method} {self.path} HTTP/1.1\r\nHost: load\r\n{kind}"
        return f"{head}Content-Length: {len(self.body)}\r\n\r\n".encode() + self.body


@dataclass(frozen=True)
class Answer:
    """What came back, and how long after the first byte was sent."""

    status: int
    headers: Mapping[str, str]
    body: bytes
    seconds: float

    def json(self) -> Any:
        """The body's document."""
        return json.loads(self.body)


class Client:
    """Sends one call at a time, over a connection that is kept as long as the service keeps it."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def send(self, call: Call) -> Answer:
        """The answer to a call; OSError or IncompleteReadError when the connection breaks."""
        reader, writer = await self._connected()
        start = time.perf_counter()
        try:
            writer.write(call.bytes())
            # A service that refuses may close before it has read all.
            with suppress(ConnectionError):
                await writer.drain()
            head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1")
            first, *lines = head.rstrip().split("\r\n")
            pairs = (line.partition(":") for line in lines)
            headers = {name.lower(): value.strip() for name, _, value in pairs}
            body = await reader.readexactly(int(headers.get("content-length", 0)))
        except BaseException:
            self.close()
            raise
        if "close" in headers.get("connection", ""):
            self.close()
        return Answer(int(first.split()[1]), headers, body, time.perf_counter() - start)

    async def leave(self, call: Call, share: float, seconds: float) -> None:
        """Send a share of a call, wait a while, and hang up."""
        _, writer = await self._connected()
        data = call.bytes()
        with suppress(ConnectionError):
            writer.write(data[: round(share * len(data))])
            await writer.drain()
        await asyncio.sleep(seconds)
        self.close()

    def close(self) -> None:
        """Hang up."""
        if self._streams is not None:
            self._streams[1].close()
            self._streams = None

    async def _connected(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        if self._streams is not None and self._streams[0].at_eof():
            self.close()
        if self._streams is None:
            self._streams = await asyncio.open_connection("127.0.0.1", self._port, limit=LIMIT)
        return self._streams


def upload(path: str, name: str, mesh: bytes, **fields: str) -> Call:
    """A form with a file."""
    parts = [
        f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="{field}"\r\n\r\n{value}\r\n'
        for field, value in fields.items()
    ]
    head = f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="mesh"; filename="{name}"\r\n\r\n'
    body = b"".join([
        "".join(parts).encode(), head.encode(), mesh, f"\r\n--{BOUNDARY}--\r\n".encode(),
    ])  # fmt: skip
    return Call(path, "POST", path, body, MULTIPART)


def by_id(path: str, mesh_id: str, **fields: str) -> Call:
    """A form that names a mesh which the service keeps."""
    body = urlencode({"mesh_id": mesh_id, **fields}).encode()
    return Call(f"{path} by id", "POST", path, body, URLENCODED)
