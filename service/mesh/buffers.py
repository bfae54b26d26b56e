"""The buffers of a glTF asset: the GLB's binary chunk, data URIs, and files of the same archive.

Nothing is ever fetched, and nothing read from disk.
"""

from __future__ import annotations

import base64
import binascii
from typing import Protocol

from service.mesh.document import Document
from service.mesh.faults import quoted, unsupported

ALIGNMENT = 4


class Files(Protocol):
    """The files that came with an asset."""

    def locate(self, uri: str) -> str:
        """The name of the file that `uri` means; ShapeError if there is none."""

    def read(self, name: str) -> bytes:
        """The content of a located file."""


class Buffers:
    """Bytes by buffer index.

    `chunk` is the GLB's binary chunk, where there is one; `files` what came with the asset.
    """

    def __init__(
        self, document: Document, chunk: memoryview | None = None, files: Files | None = None
    ) -> None:
        self._document = document
        self._chunk = chunk
        self._files = files
        self._read: dict[int, memoryview] = {}
        self._located: dict[int, str] = {}

    def __getitem__(self, index: int) -> memoryview:
        """The bytes of one buffer; UnsupportedFormat ``external_buffers`` if it is elsewhere."""
        if index not in self._read:
            self._read[index] = self._load(index)
        return self._read[index]

    def in_chunk(self, index: int) -> bool:
        """Whether buffer `index` is the GLB's binary chunk."""
        return index == 0 and "uri" not in self._document.entry("buffers", 0)

    def file(self, index: int) -> str | None:
        """The name of the file that a buffer that was read is in, if it is in one."""
        return self._located.get(index)

    def rewritten(self, index: int, content: bytes | bytearray) -> bytes:
        """That file with another `content` of the buffer; what stands behind it stays."""
        assert self._files is not None
        return bytes(content) + self._files.read(self._located[index])[len(content) :]

    def _load(self, index: int) -> memoryview:
        entry = self._document.entry("buffers", index)
        length = self._document.natural(entry, "byteLength")
        if self.in_chunk(index):
            if self._chunk is None:
                raise self._document.wrong("buffers[0] has no uri, and there is no binary chunk")
            content = self._chunk
        else:
            content = memoryview(self._decode(index, entry.get("uri")))
        if len(content) < length:
            raise self._document.wrong(f"buffers[{index}] has {len(content)} of its {length} bytes")
        return content[:length]

    def _beside(self, index: int, uri: str) -> bytes:
        if self._files is None:
            raise unsupported(
                "external_buffers",
                f"The geometry is in another file, {quoted(uri)}",
                "Upload a zip of the .gltf and its files, or a GLB",
            )
        name = self._files.locate(uri)
        if name in self._located.values():
            raise unsupported(
                "shared_buffer_file",
                f"Two buffers of the glTF are in one file, {quoted(name)}",
                "Export it with one buffer, or as GLB",
            )
        self._located[index] = name
        return self._files.read(name)

    def _decode(self, index: int, uri: object) -> bytes:
        if not isinstance(uri, str):
            raise self._document.wrong(f"buffers[{index}] has no uri")
        if not uri.startswith("data:"):
            return self._beside(index, uri)
        head, _, payload = uri.partition(",")
        if not head.endswith(";base64"):
            raise self._document.wrong(f"the data URI of buffers[{index}] is not base64")
        try:
            return base64.b64decode(payload, validate=True)
        except (binascii.Error, ValueError):
            raise self._document.wrong(
                f"the data URI of buffers[{index}] is not valid base64"
            ) from None


class Draft:
    """The buffers as they are to be written: copies of those that change, and what is added."""

    def __init__(self, buffers: Buffers) -> None:
        self._buffers = buffers
        self._copies: dict[int, bytearray] = {}
        self._tails: dict[int, bytearray] = {}

    def __getitem__(self, index: int) -> bytearray | memoryview:
        """The bytes of one buffer as they are now, without additions."""
        return self._copies.get(index, self._buffers[index])

    def writable(self, index: int) -> bytearray:
        """The bytes of one buffer, to be changed in place."""
        if index not in self._copies:
            self._copies[index] = bytearray(self._buffers[index])
        return self._copies[index]

    def append(self, index: int, content: bytes) -> int:
        """Add aligned `content` at the end of one buffer; returns its offset there."""
        tail = self._tails.setdefault(index, bytearray())
        tail.extend(bytes(-(len(self[index]) + len(tail)) % ALIGNMENT))
        offset = len(self[index]) + len(tail)
        tail.extend(content)
        return offset

    def changed(self) -> dict[int, bytes | bytearray]:
        """The new bytes of every buffer that changed."""
        result: dict[int, bytes | bytearray] = dict(self._copies)
        for index, tail in self._tails.items():
            result[index] = bytes(self[index]) + tail
        return result


def data_uri(uri: str, content: bytes | bytearray) -> str:
    """`uri` with other content."""
    return uri.partition(",")[0] + "," + base64.b64encode(content).decode()
