from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from model_export.rigfile import RigFile, node_worlds


def file(accessor: dict, view: dict, chunk: bytes) -> RigFile:
    """A document of one accessor and its bytes."""
    return RigFile({"accessors": [{"bufferView": 0, **accessor}], "bufferViews": [view]}, chunk)


def test_a_glb_is_split_into_document_and_bytes():
    text = json.dumps({"asset": {}}).encode() + b" "
    text += b" " * (-len(text) % 4)
    data = struct.pack("<4sIII4s", b"glTF", 2, 32 + len(text), len(text), b"JSON") + text
    data += struct.pack("<I4s", 4, b"BIN\0") + b"abcd"
    read = RigFile.of(data)
    assert read.document == {"asset": {}}
    assert read.chunk == b"abcd"


def test_other_bytes_are_refused():
    with pytest.raises(ValueError, match="not a GLB"):
        RigFile.of(b"ply\nformat ascii 1.0\n")


def test_elements_may_lie_apart():
    values = np.arange(12, dtype="<f4").reshape(2, 6)
    accessor = {"componentType": 5126, "type": "VEC3", "count": 2, "byteOffset": 4}
    view = {"byteLength": 48, "byteStride": 24}
    read = file(accessor, view, values.tobytes()).read(0)
    np.testing.assert_array_equal(read, [[1, 2, 3], [7, 8, 9]])


@pytest.mark.parametrize(
    ("component", "dtype", "expected"),
    [(5121, "u1", [0.0, 0.4, 1.0]), (5122, "<i2", [0.0, 102 / 32767, 255 / 32767])],
)
def test_normalised_integers_are_read_as_fractions(component, dtype, expected):
    data = np.array([0, 102, 255], dtype).tobytes()
    accessor = {"componentType": component, "type": "SCALAR", "count": 3, "normalized": True}
    read = file(accessor, {"byteLength": len(data)}, data)
    np.testing.assert_allclose(read.read(0)[:, 0], expected)
    np.testing.assert_array_equal(read.read(0, scaled=False)[:, 0], [0, 102, 255])


def test_nodes_stand_on_their_parents_in_any_order():
    nodes = [
        {"translation": [1, 0, 0]},
        {
            "translation": [0, 2, 0],
            "rotation": [0, 0, np.sqrt(0.5), np.sqrt(0.5)],
            "scale": [3] * 3,
        },
    ]
    worlds = node_worlds(nodes, np.array([1, -1]))
    np.testing.assert_allclose(worlds[1, :3, 3], [0, 2, 0])
    # A step along x, three times as long, and turned to y.
    np.testing.assert_allclose(worlds[0, :3, 3], [0, 5, 0], atol=1e-12)
