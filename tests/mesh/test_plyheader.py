from __future__ import annotations

import numpy as np
import pytest

from service.errors import InvalidMesh
from service.mesh.plyheader import TYPES, read_header

HEADER = b"""ply
format binary_big_endian 1.0
comment element face 9
obj_info whatever
element vertex 8
property float x
property uint8 flag
element face 6
property list uchar int32 vertex_indices
end_header
"""


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_elements_and_properties(end: bytes) -> None:
    data = HEADER.replace(b"\n", end)
    header = read_header(data + b"\n\r body")
    assert header.order == ">"
    assert header.body == len(data)
    vertex, face = header.elements
    assert (vertex.name, vertex.count, vertex.smallest_row) == ("vertex", 8, 5)
    assert [item.name for item in vertex.properties] == ["x", "flag"]
    assert vertex.properties[0].value == np.dtype(">f4")
    assert (face.count, face.smallest_row) == (6, 1)
    assert face.properties[0].count == np.dtype("u1")
    assert face.properties[0].value == np.dtype(">i4")


@pytest.mark.parametrize("name", TYPES)
def test_every_type_has_its_size(name: str) -> None:
    data = HEADER.replace(b"float", name.encode())
    sizes = {"8": 1, "16": 2, "32": 4, "64": 8}
    named = [size for bits, size in sizes.items() if name.endswith(bits)]
    plain = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "double": 8}
    size = named[0] if named else plain.get(name, 4)
    assert read_header(data).elements[0].properties[0].value.itemsize == size


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (b"ply", b"plx"),
        (b"end_header", b"end_heade"),
        (b"format binary_big_endian 1.0\n", b""),
        (b"binary_big_endian", b"binary"),
        (b"vertex 8", b"vertex -8"),
        (b"vertex 8", b"vertex 8.5"),
        (b"vertex 8", b"vertex"),
        (b"vertex 8", b"vertex 9999999999999"),
        (b"float x", b"float128 x"),
        (b"float x", b"float"),
        (b"list uchar", b"list float"),
        (b"list uchar", b"list"),
        (b"element vertex 8\n", b""),
        (b"obj_info", b"nonsense"),
    ],
)
def test_broken_headers_are_malformed(before: bytes, after: bytes) -> None:
    assert before in HEADER
    with pytest.raises(InvalidMesh, match="malformed_ply"):
        read_header(HEADER.replace(before, after, 1))
