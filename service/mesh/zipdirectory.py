"""The directory of a zip archive: what its members are, and where each lies in the file."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from itertools import pairwise

from service.mesh import limits
from service.mesh.faults import malformed, quoted, unsupported

LOCAL = struct.Struct("<4s5H3L2H")
CENTRAL = struct.Struct("<4s6H3L5H2L")
END = struct.Struct("<4s4H2LH")
LONGEST_COMMENT = (1 << 16) - 1
STORED, DEFLATED = 0, 8
# What a field holds whose value is in a zip64 record.
ELSEWHERE, ELSEWHERE_SHORT = 0xFFFFFFFF, 0xFFFF
UTF8 = 1 << 11


@dataclass(frozen=True)
class Entry:
    """One member.

    Attributes:
        name: as decoded, with forward slashes.
        record: its bytes in the directory.
        flags, method, crc, packed, size: what the directory says; `packed` and `size` in bytes.
        start: offset of its local header in the file.
        body: offset of its packed content, which ends at `end`.
    """

    name: str
    record: bytes
    flags: int
    method: int
    crc: int
    packed: int
    size: int
    start: int
    body: int = 0

    @property
    def end(self) -> int:
        return self.body + self.packed


@dataclass(frozen=True)
class Directory:
    """All members in the directory's order; the directory's span in the file.

    `base` is the length of what stands before the archive and that its offsets don't count.
    """

    entries: tuple[Entry, ...]
    start: int
    end: int
    base: int


def read_directory(data: bytes) -> Directory:
    """Parse the directory and check it against the members.

    Raises:
        InvalidMesh: ``malformed_zip``; members overlap, come twice or are not where they should.
        UnsupportedFormat: ``zip64_archive``.
        TooLarge: ``archive_too_large``, by what the directory says of count and sizes.
    """
    end = _find_end(data)
    _, disk, first_disk, here, count, length, offset, _ = END.unpack_from(data, end)
    if data[max(end - 20, 0) :].startswith(b"PK\6\7") or ELSEWHERE in (length, offset):
        raise _zip64()
    if disk or first_disk or here != count:
        raise malformed("zip", "it is one part of an archive in several")
    limits.check_members(count)
    start = end - length
    base = start - offset
    if base < 0:
        raise malformed("zip", "its directory is cut short")
    entries = []
    at = start
    for _ in range(count):
        entry = _entry(data, at, end, base)
        entries.append(entry)
        at += len(entry.record)
    if at != end:
        raise malformed("zip", "its directory is longer than its members need")
    limits.check_inflated(sum(entry.packed for entry in entries), [e.size for e in entries])
    placed = tuple(_placed(data, entry, start) for entry in entries)
    _check_apart(placed)
    return Directory(placed, start, end, base)


def _find_end(data: bytes) -> int:
    """Where the end record is: the last one whose comment reaches just to the file's end."""
    at = len(data)
    lowest = len(data) - END.size - LONGEST_COMMENT
    while (at := data.rfind(b"PK\5\6", max(lowest, 0), at)) >= 0:
        if at + END.size <= len(data):
            comment: int = END.unpack_from(data, at)[-1]
            if at + END.size + comment == len(data):
                return at
    raise malformed("zip", "it does not end with a directory")


def _entry(data: bytes, at: int, end: int, base: int) -> Entry:
    if at + CENTRAL.size > end or data[at : at + 4] != b"PK\1\2":
        raise malformed("zip", "its directory is cut short")
    (_, _, _, flags, method, _, _, crc, packed, size, name_length, extra, comment, disk, _, _,
     start) = CENTRAL.unpack_from(data, at)  # fmt: skip
    record = data[at : at + CENTRAL.size + name_length + extra + comment]
    if at + len(record) > end or len(record) < CENTRAL.size + name_length + extra + comment:
        raise malformed("zip", "its directory is cut short")
    if ELSEWHERE in (packed, size, start) or disk == ELSEWHERE_SHORT:
        raise _zip64()
    raw = record[CENTRAL.size : CENTRAL.size + name_length]
    name = raw.decode("utf-8" if flags & UTF8 else "cp437", "replace").replace("\\", "/")
    return Entry(name, record, flags, method, crc, packed, size, base + start)


def _placed(data: bytes, entry: Entry, end: int) -> Entry:
    """`entry` with its body found; every member lies before `end`, the directory."""
    if entry.start + LOCAL.size > end or data[entry.start : entry.start + 4] != b"PK\3\4":
        raise malformed("zip", f"its member {quoted(entry.name)} is not where it should be")
    length, extra = LOCAL.unpack_from(data, entry.start)[-2:]
    at = entry.start + LOCAL.size
    named: int = CENTRAL.unpack_from(entry.record)[10]
    name = entry.record[CENTRAL.size : CENTRAL.size + named]
    placed = replace(entry, body=at + length + extra)
    if data[at : at + length] != name or placed.end > end:
        raise malformed("zip", f"its member {quoted(entry.name)} is not where it should be")
    return placed


def _check_apart(entries: tuple[Entry, ...]) -> None:
    ordered = sorted(entries, key=lambda entry: entry.start)
    for one, other in pairwise(ordered):
        if one.end > other.start:
            raise malformed("zip", f"its members {quoted(one.name)} and {quoted(other.name)} "
                            "overlap")  # fmt: skip
    names: set[str] = set()
    for entry in entries:
        if entry.name in names:
            raise malformed("zip", f"it holds two members {quoted(entry.name)}")
        names.add(entry.name)


def _zip64() -> Exception:
    return unsupported(
        "zip64_archive",
        "The archive is a zip64, which is for more than 4 GB",
        "Zip the files again with an ordinary zip tool",
    )
