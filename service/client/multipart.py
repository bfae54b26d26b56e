"""Multipart bodies, made a chunk at a time: of known length, and as often as they are sent."""

from __future__ import annotations

import os
import secrets
from collections.abc import AsyncIterator, Callable, Iterator, Sequence

import httpx

from service.client.mesh import Mesh

CHUNK = 1 << 16

Progress = Callable[[int, int | None], object]
"""Called with the bytes that are done and how many there are, None where that is not known."""

Field = tuple[str, str]
FilePart = tuple[str, Mesh]


class Multipart(httpx.SyncByteStream, httpx.AsyncByteStream):
    """A form with files; each iteration is the whole body anew, so that a retry can send it again.

    Files are read in chunks, also by the asynchronous client: a read of a local file is short.

    Args:
        fields: names and texts.
        files: names of parts, and what they hold.
        progress: is told how much was taken for sending; from nothing again at a retry.

    Attributes:
        content_type, length: for the request's headers; bytes.

    Raises:
        OSError: when a file can't be read.
    """

    def __init__(
        self,
        fields: Sequence[Field],
        files: Sequence[FilePart],
        progress: Progress | None = None,
    ) -> None:
        self._boundary = secrets.token_hex(16)
        self._texts = b"".join(self._head(name) + text.encode() + b"\r\n" for name, text in fields)
        self._files = [(self._head(name, mesh.name), mesh, _size(mesh)) for name, mesh in files]
        self._end = f"--{self._boundary}--\r\n".encode()
        self._progress = progress
        self.content_type = f"multipart/form-data; boundary={self._boundary}"
        whole = sum(len(head) + size + 2 for head, _, size in self._files)
        self.length = len(self._texts) + whole + len(self._end)

    def __iter__(self) -> Iterator[bytes]:
        done = 0
        for chunk in self._chunks():
            yield chunk
            done += len(chunk)
            if self._progress is not None:
                self._progress(done, self.length)

    async def __aiter__(self) -> AsyncIterator[bytes]:
        for chunk in self:
            yield chunk

    def _chunks(self) -> Iterator[bytes]:
        if self._texts:
            yield self._texts
        for head, mesh, size in self._files:
            yield head
            yield from _content(mesh, size)
            yield b"\r\n"
        yield self._end

    def _head(self, name: str, filename: str | None = None) -> bytes:
        said = f'form-data; name="{_quoted(name)}"'
        if filename is not None:
            said += f'; filename="{_quoted(filename)}"\r\nContent-Type: application/octet-stream'
        return f"--{self._boundary}\r\nContent-Disposition: {said}\r\n\r\n".encode()


def _content(mesh: Mesh, size: int) -> Iterator[bytes]:
    """Exactly so many bytes of it: the length has been told already."""
    with mesh.open() as file:
        while size:
            chunk = file.read(min(CHUNK, size))
            if not chunk:
                raise OSError(f"{mesh.name!r} has become shorter while it was sent")
            size -= len(chunk)
            yield chunk


def _size(mesh: Mesh) -> int:
    with mesh.open() as file:
        at = file.tell()
        return file.seek(0, os.SEEK_END) - at


def _quoted(text: str) -> str:
    """As browsers do it."""
    return text.replace('"', "%22").replace("\r", "%0D").replace("\n", "%0A")
