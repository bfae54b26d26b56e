from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset

from service.errors import InvalidMesh, TooLarge, UnsupportedFormat
from service.mesh import limits
from service.mesh.accessors import Accessor, read_accessor, sharing_bytes
from service.mesh.buffers import Buffers
from service.mesh.document import Document

POINTS = np.random.default_rng(5).normal(size=(7, 3)).astype("<f4")


def read(asset: Asset, index: int) -> tuple[Accessor, Buffers]:
    document = Document("glb", json.dumps(asset.root).encode())
    buffers = Buffers(document, memoryview(bytes(asset.chunk)))
    return read_accessor(document, buffers, index), buffers


def test_plain_floats() -> None:
    asset = Asset()
    asset.view(b"abc")
    accessor, buffers = read(asset, asset.accessor(POINTS))
    assert (accessor.count, accessor.width, accessor.normalized) == (7, 3, False)
    assert np.array_equal(accessor.stored(buffers), POINTS)
    assert accessor.decode(accessor.stored(buffers)).dtype == np.float64
    encoded = accessor.encode(POINTS.astype(np.float64))
    assert encoded is not None
    assert np.array_equal(encoded, POINTS)


def test_interleaved_arrays_share_a_view() -> None:
    asset = Asset()
    first, second = asset.interleaved(POINTS, POINTS[:, :2] + 9)
    for index, expected in ((first, POINTS), (second, POINTS[:, :2] + 9)):
        accessor, buffers = read(asset, index)
        assert accessor.span is not None
        assert accessor.span.stride == 20
        assert np.array_equal(accessor.stored(buffers), expected)


def test_offset_inside_the_view() -> None:
    asset = Asset()
    view = asset.view(b"\0" * 8 + POINTS.tobytes())
    accessor, buffers = read(asset, asset.accessor(POINTS, view, byteOffset=8))
    assert np.array_equal(accessor.stored(buffers), POINTS)


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2"])
@pytest.mark.parametrize("normalized", [False, True])
def test_integers_are_steps(dtype: str, normalized: bool) -> None:
    info = np.iinfo(dtype)
    stored = np.array([[info.min, 0, info.max], [1, 2, 3]], dtype)
    asset = Asset()
    accessor, buffers = read(asset, asset.accessor(stored, normalized=normalized))
    values = accessor.decode(accessor.stored(buffers))
    expected = np.maximum(stored / info.max, -1) if normalized else stored
    assert np.allclose(values, expected)
    encoded = accessor.encode(values)
    assert encoded is not None
    assert np.array_equal(accessor.decode(encoded), values)
    assert accessor.encode(values + 1.5 * np.abs(values).max()) is None


def test_sparse_values_replace_the_base() -> None:
    rows = np.array([1, 5], "<u2")
    asset = Asset()
    over_zeros = asset.sparse(rows, POINTS[:2], base=7)
    over_base = asset.sparse(rows.astype("u1"), POINTS[:2], base=POINTS)
    expected = np.zeros((7, 3))
    expected[rows] = POINTS[:2]
    accessor, buffers = read(asset, over_zeros)
    assert np.array_equal(accessor.stored(buffers), expected)
    assert accessor.sparse is not None
    expected = POINTS.copy()
    expected[rows] = POINTS[:2]
    accessor, buffers = read(asset, over_base)
    assert np.array_equal(accessor.stored(buffers), expected)


def test_nothing_stored_is_all_zero() -> None:
    asset = Asset()
    index = asset.accessor(POINTS)
    del asset.root["accessors"][index]["bufferView"]
    accessor, buffers = read(asset, index)
    assert not accessor.stored(buffers).any()
    assert accessor.spans == []


def test_accessors_that_may_share_bytes_are_told() -> None:
    asset = Asset()
    apart = asset.accessor(POINTS)
    first = asset.accessor(POINTS)
    view = asset.root["accessors"][first]["bufferView"]
    row = asset.accessor(POINTS[:1], view, byteOffset=12)
    rest = asset.accessor(POINTS[2:], view, byteOffset=24)
    woven = asset.interleaved(POINTS, POINTS)
    after = asset.accessor(POINTS)
    accessors = [read(asset, i)[0] for i in (apart, first, row, rest, *woven, after)]
    assert sharing_bytes(accessors) == {first, row, rest, *woven}


BROKEN: list[dict[str, Any]] = [
    {"componentType": 5124},
    {"componentType": "5126"},
    {"type": "MAT3"},
    {"type": ["VEC3"]},
    {"count": 8},
    {"count": -1},
    {"count": 1 << 50},
    {"count": 1.5},
    {"byteOffset": 4},
    {"bufferView": 99},
    {"bufferView": None},
    {"sparse": 1},
    {"sparse": {"count": 1}},
    {"sparse": {"count": 1, "indices": {"bufferView": 0, "componentType": 5122}, "values": {}}},
    {"sparse": {"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {}}},
    {
        "sparse": {
            "count": 4,
            "indices": {"bufferView": 0, "componentType": 5121},
            "values": {"bufferView": 0},
        }
    },
]


@pytest.mark.parametrize("change", BROKEN)
def test_broken_accessors_are_malformed(change: dict[str, Any]) -> None:
    asset = Asset()
    index = asset.accessor(POINTS)
    asset.root["accessors"][index].update(change)
    with pytest.raises(InvalidMesh, match="malformed_glb"):
        read(asset, index)


@pytest.mark.parametrize(
    "change",
    [
        {"byteStride": 8},
        {"byteStride": 40},
        {"byteLength": 80},
        {"byteLength": 1 << 40},
        {"byteOffset": 1 << 20},
        {"buffer": 1},
    ],
)
def test_broken_views_are_malformed(change: dict[str, Any]) -> None:
    asset = Asset()
    index = asset.accessor(POINTS)
    asset.root["bufferViews"][0].update(change)
    with pytest.raises(InvalidMesh, match="malformed_glb"):
        read(asset, index)


def test_compressed_views_are_refused() -> None:
    asset = Asset()
    index = asset.accessor(POINTS)
    asset.root["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {}}
    with pytest.raises(UnsupportedFormat, match="compressed_geometry"):
        read(asset, index)


def test_sparse_accessors_of_nothing_have_a_largest_size() -> None:
    asset = Asset()
    rows, points = np.array([0], "<u2"), np.zeros((1, 3), "<f4")
    index = asset.sparse(rows, points, base=limits.VERTICES + 1)
    with pytest.raises(TooLarge, match="too_many_vertices"):
        read(asset, index)
    entry = asset.root["accessors"][asset.sparse(rows, points, base=4)]
    entry["sparse"]["count"] = 1 << 52
    with pytest.raises(InvalidMesh, match="too short"):
        read(asset, index + 1)


def test_unstored_accessors_have_a_largest_size() -> None:
    asset = Asset()
    index = asset.accessor(POINTS)
    del asset.root["accessors"][index]["bufferView"]
    asset.root["accessors"][index]["count"] = limits.VERTICES + 1
    with pytest.raises(TooLarge):
        read(asset, index)
