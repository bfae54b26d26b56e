"""Ways to damage a file, from single bits to the structure of its JSON."""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from random import Random
from typing import Any

JSON_CHUNK = 0x4E4F534A
HEADER = 128
"""Bytes at a file's start where counts and lengths stand in most formats."""
NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
NUMBERS = [
    b"nan", b"-inf", b"1e308", b"-1e308", b"1e-320", b"1e999", b"-1", b"0", b"-0.0", b"1",
    b"65535", b"2147483648", b"4294967295", b"999999999999", b"9" * 400, b"0x10", b"1_000", b"",
    b"3.7", b"--1", b"1e", "\u0661".encode(),
]  # fmt: skip
WORDS = [0, 1, 3, 255, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7F800000, 0x7FC00000, 0x7F7FFFFF]
VALUES: list[Any] = [
    None, True, -1, 0, 1, 2.5, 1 << 31, 1 << 53, 10**400, 1e308, float("nan"), float("inf"), "",
    "0", "\ud800", [], {}, [0], [[]], {"a": 1}, "KHR_draco_mesh_compression", 5126, "VEC3",
    [1e308, 0, 0], 2_000_000, "data:,", "data:application/octet-stream;base64,AAAA",
]  # fmt: skip

Mutation = Callable[[bytes, Random], bytes]


def mutate(data: bytes, random: Random, donor: bytes = b"") -> bytes:
    """`data` damaged in one to three ways; a splice takes its piece from `donor`."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        if donor and random.random() < 0.05:
            data = spliced(data, donor, random)
        elif data.startswith(b"PK") and random.random() < 0.6:
            data = member(data, random)
        else:
            data = random.choice(MUTATIONS)(data, random)
    return data


def bits(data: bytes, random: Random) -> bytes:
    """A few bits flipped."""
    if not data:
        return data
    content = bytearray(data)
    for _ in range(random.randint(1, 8)):
        content[random.randrange(len(content))] ^= 1 << random.randrange(8)
    return bytes(content)


def truncated(data: bytes, random: Random) -> bytes:
    """The end missing."""
    return data[: random.randint(0, len(data))]


def removed(data: bytes, random: Random) -> bytes:
    """A piece missing."""
    start = random.randint(0, len(data))
    return data[:start] + data[start + random.randint(1, 64) :]


def repeated(data: bytes, random: Random) -> bytes:
    """A piece twice, or many times."""
    start = random.randint(0, len(data))
    piece = data[start : start + random.randint(1, 200)]
    return data[:start] + piece * random.choice((2, 2, 5, 50)) + data[start + len(piece) :]


def overwritten(data: bytes, random: Random) -> bytes:
    """A few random bytes in place of others."""
    start = random.randint(0, len(data))
    piece = random.randbytes(random.randint(1, 16))
    return data[:start] + piece + data[start + len(piece) :]


def spliced(data: bytes, donor: bytes, random: Random) -> bytes:
    """The beginning of one file and the end of another."""
    return data[: random.randint(0, len(data))] + donor[random.randint(0, len(donor)) :]


def word(data: bytes, random: Random) -> bytes:
    """One telling 32-bit word, half of the time near the start."""
    end = min(HEADER, len(data)) if random.random() < 0.5 else len(data)
    if end < 4:
        return data
    start = random.randrange(0, end - 3) & ~3
    order = random.choice("<>")
    return data[:start] + struct.pack(order + "I", random.choice(WORDS)) + data[start + 4 :]


def number(data: bytes, random: Random) -> bytes:
    """One number of the text replaced by a telling one, half of the time near the start."""
    near = 0 if random.random() < 0.5 else random.randint(0, len(data))
    found = list(NUMBER.finditer(data, near, near + 4 * HEADER))
    if not found:
        return data
    match = random.choice(found)
    return data[: match.start()] + random.choice(NUMBERS) + data[match.end() :]


def nudged(data: bytes, random: Random) -> bytes:
    """One number, of the text or a float32 of a binary file, slightly or grossly another."""
    factor = random.choice((0.0, -1.0, 0.99, 1.5, 10.0, 1e4, 1e-4))
    if b"\0" in data[:4096] and len(data) > HEADER + 4:
        start = random.randrange(HEADER, len(data) - 3) & ~3
        value = struct.unpack_from("<f", data, start)[0] * factor
        if not abs(value) < 3e38:
            return data
        return data[:start] + struct.pack("<f", value) + data[start + 4 :]
    start = random.randint(0, len(data))
    match = NUMBER.search(data, start)
    if match is None or len(match[0]) > 30:
        return data
    whole = match[0].lstrip(b"-").isdigit()
    new = int(match[0]) + random.choice((-1, 1, 2)) if whole else float(match[0]) * factor
    return data[: match.start()] + repr(new).encode() + data[match.end() :]


def line(data: bytes, random: Random) -> bytes:
    """Two lines of the text swapped, or one left out or doubled."""
    start = random.randint(0, len(data))
    lines = data[start : start + 2000].split(b"\n")
    if len(lines) < 3:
        return data
    one, two = random.randrange(len(lines)), random.randrange(len(lines))
    lines[one : one + 1] = random.choice(([], [lines[one]] * 2, [lines[two]]))
    return data[:start] + b"\n".join(lines) + data[start + 2000 :]


def tree(data: bytes, random: Random) -> bytes:
    """One value of glTF's JSON replaced, removed, doubled or nested; lengths are put right."""
    found = _document(data)
    if found is None:
        return word(data, random)
    text, binary = found
    try:
        root = json.loads(text)
    except (ValueError, RecursionError):
        return number(data, random)
    places = _places(root)
    if not places:
        return data
    owner, key = random.choice(places)
    match random.randrange(5):
        case 0 if isinstance(owner, dict):
            del owner[key]
        case 1 if isinstance(owner, list):
            owner.append(owner[key])
        case 2:
            owner[key] = [owner[key]] * random.choice((1, 3))
        case 3 if type(owner[key]) in (int, float) and abs(owner[key]) < 1e15:
            owner[key] += random.choice((-1, 1, 0.5, 4, 1000))
        case _:
            owner[key] = random.choice(VALUES)
    changed = json.dumps(root).encode()
    if random.random() < 0.1:
        # The same name twice in one object.
        changed = changed.replace(b"{", b'{"nodes":[],"accessors":[{}],', 1)
    return changed if binary is None else _packed(changed, binary)


def member(data: bytes, random: Random) -> bytes:
    """One member of a zip damaged before it is packed, so that the archive itself is sound."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            contents = [(info, archive.read(info)) for info in archive.infolist()]
    except ODD:
        return word(data, random)
    files = [place for place, (info, _) in enumerate(contents) if not info.is_dir()]
    if not files:
        return data
    place = random.choice(files)
    info, content = contents[place]
    contents[place] = info, random.choice(MUTATIONS)(content, random)
    target = io.BytesIO()
    try:
        with zipfile.ZipFile(target, "w") as archive:
            for info, content in contents:
                archive.writestr(info, content)
    except ODD:
        return word(data, random)
    return target.getvalue()


def _document(data: bytes) -> tuple[bytes, bytes | None] | None:
    """The JSON of a glTF, and of a GLB what follows it."""
    if data.startswith(b"glTF") and len(data) >= 20:
        end = 20 + struct.unpack_from("<I", data, 12)[0]
        return data[20:end], data[end:]
    return (data, None) if data.lstrip().startswith(b"{") else None


def _packed(text: bytes, rest: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    length = 20 + len(text) + len(rest)
    return struct.pack("<4sIIII", b"glTF", 2, length, len(text), JSON_CHUNK) + text + rest


def _places(root: Any) -> list[tuple[Any, Any]]:
    """Every container of a JSON value, with each of its keys."""
    places: list[tuple[Any, Any]] = []
    pending = [root] if isinstance(root, dict | list) else []
    while pending:
        owner = pending.pop()
        keys = list(owner) if isinstance(owner, dict) else range(len(owner))
        places += [(owner, key) for key in keys]
        pending += [owner[key] for key in keys if isinstance(owner[key], dict | list)]
    return places


# What the library raises for archives that are damaged already.
ODD = (
    zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, struct.error, ValueError, RuntimeError,
    OSError, EOFError, OverflowError,
)  # fmt: skip
MUTATIONS: list[Mutation] = [
    bits, bits, truncated, removed, repeated, overwritten, word, word, number, number, nudged,
    nudged, nudged, line, tree, tree, tree,
]  # fmt: skip
