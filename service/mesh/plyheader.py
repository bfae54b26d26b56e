"""The header of a PLY file: its encoding, elements and properties."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from service.mesh.faults import malformed, quoted

TYPES = {
    "char": "i1", "int8": "i1",
    "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4",
    "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
# A body may begin with a byte that looks like a line end: only the header's own kind counts.
END = {
    b"\n": re.compile(rb"\n[ \t]*end_header[ \t\r]*\n"),
    b"\r": re.compile(rb"\r[ \t]*end_header[ \t]*\r"),
}
FIRST_LINE = re.compile(rb"ply[ \t]*\r?\n")
LONGEST_HEADER = 1 << 20


@dataclass(frozen=True)
class Property:
    """One property: a scalar, or a list where `count` gives the type of its length."""

    name: str
    value: np.dtype[np.generic]
    count: np.dtype[np.generic] | None


@dataclass(frozen=True)
class Element:
    """`count` rows of the same properties."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def smallest_row(self) -> int:
        """Bytes of a binary row whose lists are all empty."""
        return sum((p.count or p.value).itemsize for p in self.properties)


@dataclass(frozen=True)
class Header:
    """`order` is numpy's byte order, empty for ASCII; `body` the offset of the first element."""

    order: str
    elements: tuple[Element, ...]
    body: int


def read_header(data: bytes) -> Header:
    """Parse the header; InvalidMesh ``malformed_ply`` if it is none."""
    line_end = b"\n" if FIRST_LINE.match(data) else b"\r"
    end = END[line_end].search(data, 0, LONGEST_HEADER)
    if not data.startswith(b"ply") or end is None:
        raise malformed("ply", "there is no header from 'ply' to 'end_header'")
    order: str | None = None
    elements: list[tuple[str, int, list[Property]]] = []
    for line in re.split(r"\r\n|\n|\r", data[: end.start()].decode("latin-1"))[1:]:
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", encoding, _] if encoding in ORDERS:
                order = ORDERS[encoding]
            case ["element", name, count] if re.fullmatch("[0-9]{1,12}", count):
                elements.append((name, int(count), []))
            case ["property", *words] if elements:
                elements[-1][2].append(_property(words, order or "", line))
            case _:
                raise malformed("ply", f"its header has the line {quoted(line)}")
    if order is None:
        raise malformed("ply", "its header has no 'format' line")
    found = tuple(Element(name, count, tuple(items)) for name, count, items in elements)
    return Header(order, found, end.end())


def _property(words: list[str], order: str, line: str) -> Property:
    match words:
        case [kind, name] if kind in TYPES:
            return Property(name, np.dtype(order + TYPES[kind]), None)
        case ["list", count, kind, name] if kind in TYPES and TYPES.get(count, "f")[0] in "iu":
            return Property(name, np.dtype(order + TYPES[kind]), np.dtype(order + TYPES[count]))
        case _:
            raise malformed("ply", f"its header has the line {quoted(line)}")
