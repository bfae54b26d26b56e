from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.errors import InvalidMesh
from service.mesh.plybody import as_doubles, read_rows
from service.mesh.plyheader import Element, Property

CODES = {"<f4": "<f", ">f4": ">f", "<i4": "<i", ">u2": ">H", "u1": "<B", "i1": "<b", "<f8": "<d"}
kinds = st.sampled_from(list(CODES))


def pack(kind: str, *values: float) -> bytes:
    return b"".join(struct.pack(CODES[kind], value) for value in values)


@settings(deadline=None, database=None)
@given(st.data())
def test_any_rows_are_read_back(data: st.DataObject) -> None:
    count = data.draw(st.integers(0, 6))
    plan = data.draw(st.lists(st.tuples(kinds, st.none() | kinds), max_size=4))
    plan = [(kind, length if length not in ("<f4", ">f4", "<f8") else "u1")
            for kind, length in plan]  # fmt: skip
    alike = data.draw(st.booleans())
    fixed = data.draw(st.integers(0, 4))
    number = st.integers(0, 100)
    content, start = b"xyz", 3
    expected: list[list[list[int]]] = []
    for _ in range(count):
        row = []
        for kind, length in plan:
            size = 1 if length is None else fixed if alike else data.draw(st.integers(0, 4))
            values = data.draw(st.lists(number, min_size=size, max_size=size))
            content += (b"" if length is None else pack(length, size)) + pack(kind, *values)
            row.append(values)
        expected.append(row)
    properties = tuple(
        Property(f"p{i}", np.dtype(kind), None if length is None else np.dtype(length))
        for i, (kind, length) in enumerate(plan)
    )
    rows = read_rows(Element("e", count, properties), memoryview(content + b"tail"), start)
    assert rows.end == (len(content) if plan else start)
    for i, (kind, length) in enumerate(plan):
        column = [row[i] for row in expected]
        if length is None:
            assert rows.scalars[f"p{i}"].tolist() == [value for (value,) in column]
            for place, (value,) in zip(rows.places[f"p{i}"], column, strict=True):
                size = struct.calcsize(CODES[kind])
                assert content[place : place + size] == pack(kind, value)
        else:
            assert rows.lists[f"p{i}"].counts.tolist() == [len(values) for values in column]
            assert rows.lists[f"p{i}"].values.tolist() == [v for values in column for v in values]


LIST = Property("l", np.dtype("<i4"), np.dtype("i1"))


@pytest.mark.parametrize(
    ("count", "content"),
    [
        (1, b""),
        (1, b"\x01\0\0\0"),
        (1, b"\x02\0\0\0\0"),
        (2, b"\x00\x01\0\0\0"),
        (3, b"\x00\x01\0\0\0\0"),
        (1 << 39, b"\0" * 99),
    ],
)
def test_bodies_that_end_early_are_malformed(count: int, content: bytes) -> None:
    with pytest.raises(InvalidMesh, match="ends within"):
        read_rows(Element("face", count, (LIST,)), memoryview(content), 0)


@pytest.mark.parametrize("content", [b"\xff\0\0", b"\0\xff\0\0\0\0\0", b"\x7f\0\0"])
def test_impossible_lengths_are_malformed(content: bytes) -> None:
    with pytest.raises(InvalidMesh, match=r"length (-1|127)"):
        read_rows(Element("face", 2, (LIST,)), memoryview(content), 0)


@pytest.mark.parametrize("content", [b"", b"\1\1\0\0\0", b"\0\0\2" + bytes(8)])
def test_rows_of_one_short_list_may_not_end_early(content: bytes) -> None:
    corners = Property("l", np.dtype("<i4"), np.dtype("u1"))
    shade = Property("c", np.dtype("u1"), None)
    with pytest.raises(InvalidMesh, match="ends within"):
        read_rows(Element("face", 2, (corners, shade)), memoryview(content), 0)


def test_elements_without_properties_take_no_time() -> None:
    rows = read_rows(Element("none", 1 << 39, ()), memoryview(b"abc"), 1)
    assert (rows.end, rows.scalars, rows.lists) == (1, {}, {})


def test_ascii_tokens_are_rows_of_doubles() -> None:
    element = as_doubles(Element("face", 2, (LIST, Property("c", np.dtype("u1"), None))))
    body = np.array([2, 5, 6, 255, 0, 7], np.float64)
    rows = read_rows(element, memoryview(body.tobytes()), 0)
    assert rows.lists["l"].counts.tolist() == [2, 0]
    assert rows.lists["l"].values.tolist() == [5, 6]
    assert rows.scalars["c"].tolist() == [255, 7]
    assert rows.places["c"].tolist() == [24, 40]
