"""A zip archive in memory: members read within limits, and some of them replaced.

Whatever is not replaced keeps its bytes, compressed as they are: order, names, dates, attributes,
comments and what stands between members.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from functools import cached_property

from service.mesh.faults import malformed, quoted, unsupported
from service.mesh.zipdirectory import CENTRAL, DEFLATED, END, LOCAL, STORED, Entry, read_directory

ENCRYPTED, DESCRIBED = 1 << 0, 1 << 3
ZIP64_EXTRA = 1


class Archive:
    """The members of a zip file; see `read_directory` for what is refused."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self._directory = read_directory(data)
        self._contents: dict[str, bytes] = {}

    @cached_property
    def members(self) -> dict[str, Entry]:
        """Files by name, in the directory's order; folders are left out."""
        entries = self._directory.entries
        return {entry.name: entry for entry in entries if not entry.name.endswith("/")}

    @property
    def parts(self) -> int:
        """How many members have been read so far."""
        return len(self._contents)

    def read(self, name: str) -> bytes:
        """The content of member `name`, inflated no further than its size in the directory.

        Raises:
            UnsupportedFormat: ``encrypted_member`` or ``zip_compression``.
            InvalidMesh: ``malformed_zip``: it is damaged, or longer than the directory says.
        """
        if name not in self._contents:
            self._contents[name] = self._inflate(self.members[name])
        return self._contents[name]

    def _inflate(self, entry: Entry) -> bytes:
        if entry.flags & ENCRYPTED:
            raise unsupported(
                "encrypted_member",
                f"The archive's member {quoted(entry.name)} is encrypted",
                "Zip the files without a password",
            )
        content = self.data[entry.body : entry.end]
        if entry.method == DEFLATED:
            try:
                # One byte more than there should be tells a member that lies about its size.
                content = zlib.decompressobj(-zlib.MAX_WBITS).decompress(content, entry.size + 1)
            except zlib.error:
                content = b""
        elif entry.method != STORED:
            raise unsupported(
                "zip_compression",
                f"The archive's member {quoted(entry.name)} is compressed by method {entry.method}",
                "Zip the files with ordinary (deflate) compression",
            )
        if len(content) != entry.size or zlib.crc32(content) != entry.crc:
            raise malformed("zip", f"its member {quoted(entry.name)} is damaged")
        return content

    def replaced(self, contents: Mapping[str, bytes]) -> bytes:
        """The archive with new `contents` of some members; itself where none differs."""
        changed = {n: content for n, content in contents.items() if content != self.read(n)}
        if not changed:
            return self.data
        pieces: list[bytes] = []
        records: dict[str, bytes] = {}
        length = done = 0
        for entry in sorted(self._directory.entries, key=lambda entry: entry.start):
            pieces.append(self.data[done : entry.start])
            length += entry.start - done
            start = length - self._directory.base
            done, record = entry.start, entry.record
            if entry.name in changed:
                member, record = self._packed(entry, changed[entry.name])
                pieces.append(member)
                length += len(member)
                done = entry.end + self._described(entry)
            records[entry.name] = record[: CENTRAL.size - 4] + _long(start) + record[CENTRAL.size :]
        pieces.append(self.data[done : self._directory.start])
        start = length + len(pieces[-1]) - self._directory.base
        pieces += [records[entry.name] for entry in self._directory.entries]
        tail = self.data[self._directory.end :]
        # The directory's offset is the last field but the comment.
        return b"".join([*pieces, tail[: END.size - 6], _long(start), tail[END.size - 2 :]])

    def _packed(self, entry: Entry, content: bytes) -> tuple[bytes, bytes]:
        """Header and body of a member, and its directory record, for another content."""
        body = content
        if entry.method == DEFLATED:
            packer = zlib.compressobj(wbits=-zlib.MAX_WBITS)
            body = packer.compress(content) + packer.flush()
        # Sizes stand in the header, so nothing needs to follow the body.
        flags = entry.flags & ~DESCRIBED
        sizes = struct.pack("<3L", zlib.crc32(content), len(body), len(content))
        name_at = entry.start + LOCAL.size
        name_length, extra_length = LOCAL.unpack_from(self.data, entry.start)[-2:]
        name = self.data[name_at : name_at + name_length]
        extra = _without_zip64(self.data[entry.body - extra_length : entry.body])
        header = self.data[entry.start : entry.start + 6] + struct.pack("<H", flags)
        header += self.data[entry.start + 8 : entry.start + 14] + sizes
        header += struct.pack("<2H", name_length, len(extra))
        record = entry.record[:8] + struct.pack("<H", flags) + entry.record[10:16] + sizes
        return header + name + extra + body, record + entry.record[28:]

    def _described(self, entry: Entry) -> int:
        """The length of the descriptor that follows a body whose header has no sizes."""
        if not entry.flags & DESCRIBED:
            return 0
        for mark in (b"PK\7\x08", b""):
            for form in ("<3L", "<L2Q"):
                text = mark + struct.pack(form, entry.crc, entry.packed, entry.size)
                if self.data.startswith(text, entry.end):
                    return len(text)
        raise malformed("zip", f"its member {quoted(entry.name)} has no descriptor")


def _long(value: int) -> bytes:
    return struct.pack("<L", value)


def _without_zip64(extra: bytes) -> bytes:
    """A header's extra fields but for the sizes of a zip64, which are in the header now."""
    kept = b""
    at = 0
    while at + 4 <= len(extra):
        kind, length = struct.unpack_from("<2H", extra, at)
        if kind != ZIP64_EXTRA:
            kept += extra[at : at + 4 + length]
        at += 4 + length
    return kept + extra[at:]
