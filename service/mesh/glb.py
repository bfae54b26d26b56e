"""GLB, glTF's binary container: a JSON chunk, a binary chunk, and others that ride along."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from service.mesh import limits
from service.mesh.buffers import Buffers
from service.mesh.document import Document, Object
from service.mesh.faults import malformed, unsupported
from service.mesh.gltf import GltfFile
from service.mesh.jsontext import dump

HEADER = struct.Struct("<4sII")
CHUNK = struct.Struct("<II")
JSON, BIN = 0x4E4F534A, 0x004E4942

Buffer = bytes | bytearray | memoryview


@dataclass(frozen=True)
class Chunk:
    """A chunk's kind, and where its content lies in the file."""

    kind: int
    start: int
    end: int


class GlbFile(GltfFile):
    """A GLB file."""

    format = "glb"
    media_type = "model/gltf-binary"

    def _open(self) -> tuple[Document, Buffers]:
        self._chunks = read_chunks(self.data)
        first, *others = self._chunks
        if first.kind != JSON:
            raise malformed("glb", "its first chunk is not JSON")
        # Chunks are padded with spaces; some writers use zeros.
        document = Document("glb", self.data[first.start : first.end].rstrip(b" \0"))
        chunk = None
        if others and others[0].kind == BIN:
            chunk = memoryview(self.data)[others[0].start : others[0].end]
        return document, Buffers(document, chunk, self._files)

    def _pack(self, text: str, chunk: bytes | bytearray | None) -> bytes:
        first, *others = self._chunks
        data = memoryview(self.data)
        pieces: list[Buffer] = [data[HEADER.size : first.end]]
        if text != self.document.text:
            encoded = text.encode()
            pieces = packed(JSON, encoded, b" " * (-len(encoded) % 4))
        done = first.end
        if chunk is not None:
            binary = others[0]
            # Padding that the file has already is kept as it is.
            padding = data[binary.start + len(chunk) : binary.end]
            pieces += packed(BIN, chunk, padding or b"\0" * (-len(chunk) % 4))
            done = binary.end
        end = self._chunks[-1].end
        pieces.append(data[done:end])
        length = HEADER.size + sum(map(len, pieces))
        return b"".join([HEADER.pack(b"glTF", 2, length), *pieces, data[end:]])


def glb(root: Object, chunk: Buffer) -> bytes:
    """A GLB of a JSON document and its binary chunk."""
    text = dump(root).encode()
    pieces = packed(JSON, text, b" " * (-len(text) % 4))
    pieces += packed(BIN, chunk, bytes(-len(chunk) % 4))
    return b"".join([HEADER.pack(b"glTF", 2, HEADER.size + sum(map(len, pieces))), *pieces])


def packed(kind: int, content: Buffer, padding: Buffer) -> list[Buffer]:
    """A chunk: its header, content and padding."""
    return [CHUNK.pack(len(content) + len(padding), kind), content, padding]


def read_chunks(data: bytes) -> list[Chunk]:
    """Where the chunks lie; bytes behind the length that the header tells are no chunk."""
    if len(data) < HEADER.size or not data.startswith(b"glTF"):
        raise malformed("glb", "it does not begin with a glTF header")
    _, version, length = HEADER.unpack_from(data)
    if version != 2:
        raise unsupported("gltf_version", f"The file is GLB version {version}", "Export glTF 2.0")
    if length > len(data):
        raise malformed("glb", f"it has {len(data)} of its {length} bytes")
    chunks: list[Chunk] = []
    at = HEADER.size
    while at + CHUNK.size <= length:
        size, kind = CHUNK.unpack_from(data, at)
        start, at = at + CHUNK.size, at + CHUNK.size + size
        if at > length:
            raise malformed("glb", f"its chunk at byte {start - CHUNK.size} is cut short")
        chunks.append(Chunk(kind, start, at))
        limits.check_parts(len(chunks))
    if not chunks:
        raise malformed("glb", "it holds no chunks")
    return chunks
