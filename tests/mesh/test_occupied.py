from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset
from mesh_samples import ball, bend, bend_some

from service.mesh.accessors import Span
from service.mesh.document import Document
from service.mesh.formats import read_mesh
from service.mesh.occupied import Occupied

VERTICES, FACES, _ = ball()
BUFFER = bytearray(1000)


def occupied(offset: int, stride: int, count: int = 10) -> Occupied:
    """By one accessor of 4-byte elements."""
    root: dict[str, Any] = {
        "bufferViews": [
            {"buffer": 0, "byteOffset": offset, "byteLength": 400, "byteStride": stride}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5125, "count": count, "type": "SCALAR"},
            {"bufferView": 9, "componentType": 5125, "count": count, "type": "SCALAR"},
        ],
    }
    document = Document("gltf", repr(root).replace("'", '"').encode())
    return Occupied(document, [BUFFER], [0, 1, 77])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("span", "size", "meets"),
    [
        (Span(0, 0, 12, 8), 12, False),
        (Span(0, 0, 12, 9), 12, True),
        # Ends with its last element, not with its stride.
        (Span(0, 0, 50, 3), 4, True),
        (Span(0, 0, 96, 2), 4, False),
        (Span(0, 140, 12, 5), 12, False),
        (Span(0, 139, 12, 5), 12, True),
        (Span(1, 100, 4, 10), 4, False),
        (Span(0, 100, 4, 0), 4, False),
    ],
)
def test_spans_meet_where_they_share_bytes(span: Span, size: int, meets: bool) -> None:
    assert occupied(100, 4).meets(span, size) is meets


@pytest.mark.parametrize(
    ("offset", "size", "meets"),
    [(104, 8, False), (92, 4, False), (88, 12, True), (102, 4, True), (97, 4, True)],
)
def test_interleaved_arrays_take_turns(offset: int, size: int, meets: bool) -> None:
    assert occupied(100, 12).meets(Span(0, offset, 12, 10), size) is meets


def test_positions_that_lie_on_their_indices_leave_them_alone() -> None:
    asset = Asset()
    corners = FACES.reshape(-1).astype("<u4")
    indices = asset.accessor(corners)
    # Indices as positions are tiny numbers; the last two rows are real ones behind them.
    tail = asset.view(VERTICES[:2].astype("<f4").tobytes())
    view = asset.root["bufferViews"][tail]
    start = view["byteOffset"] - 40 * 12
    asset.root["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": 42 * 12})
    position = asset._add(
        "accessors",
        {"bufferView": tail + 1, "componentType": 5126, "count": 42, "type": "VEC3"},
    )
    triangle = asset.accessor(np.array([0, 40, 41], "<u2"))
    attributes = {"attributes": {"POSITION": position}}
    asset.node(mesh=asset.mesh(attributes | {"indices": indices}))
    asset.node(mesh=asset.mesh(attributes | {"indices": triangle}))
    mesh = read_mesh(asset.glb())
    new, linear, _ = bend_some(mesh.vertices)
    again = read_mesh(mesh.write(new, linear))
    assert np.array_equal(again.faces, mesh.faces)
    assert np.allclose(again.vertices, new, atol=1e-6)


def test_a_file_whose_arrays_keep_apart_does_not_grow() -> None:
    asset = Asset()
    texture = VERTICES[:, :2].astype("<f4")
    position, coordinates = asset.interleaved(VERTICES.astype("<f4"), texture)
    indices = asset.accessor(FACES.reshape(-1).astype("<u2"))
    attributes = {"POSITION": position, "TEXCOORD_0": coordinates}
    asset.node(mesh=asset.mesh({"attributes": attributes, "indices": indices}))
    mesh = read_mesh(asset.gltf())
    written = mesh.write(*bend(mesh.vertices))
    assert b'"bufferViews": [{' in written
    assert len(written) < len(mesh.data) + 100
