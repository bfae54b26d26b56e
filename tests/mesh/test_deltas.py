from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset, unpack
from mesh_samples import asset as ball_asset

from service.mesh.accessors import read_accessor
from service.mesh.additions import Additions
from service.mesh.buffers import Draft
from service.mesh.deltas import QUANTIZATION, Deltas
from service.mesh.glb import GlbFile


def written(
    values: np.ndarray, quantize: bool = False, size: float = 1.0
) -> tuple[Any, np.ndarray]:
    """The JSON and the values of displacements that were stored in an asset."""
    file = GlbFile(ball_asset().glb())
    deltas = Deltas(Additions(file.document, Draft(file.buffers)), quantize)
    index = deltas.positions(values, size)
    edits = deltas.additions.edits() | deltas.extensions(file.document)
    data = file.assemble(edits, deltas.additions.draft)[""]
    result = GlbFile(data)
    accessor = read_accessor(result.document, result.buffers, index)
    root = unpack(data)[0]
    return root, accessor.decode(accessor.stored(result.buffers))


def some(count: int, moved: int) -> np.ndarray:
    values = np.zeros((count, 3))
    values[:moved] = np.linspace(-0.4, 0.5, 3 * moved).reshape(moved, 3)
    return values


@pytest.mark.parametrize(("moved", "kind"), [(0, "zero"), (10, "sparse"), (100, "dense")])
@pytest.mark.parametrize("quantize", [False, True])
def test_what_stays_takes_no_room(moved: int, kind: str, quantize: bool) -> None:
    values = some(100, moved)
    root, back = written(values, quantize)
    entry = root["accessors"][-1]
    assert ("sparse" in entry, "bufferView" in entry) == (kind == "sparse", kind == "dense")
    assert np.abs(back - values).max() < (2e-5 if quantize else 1e-7)
    scale = 32767 if entry.get("normalized") else 1
    assert np.allclose(np.array(entry["max"]) / scale, values.max(axis=0), atol=2e-5)


def test_large_sparse_accessors_have_long_indices() -> None:
    root, back = written(some(70_000, 3))
    assert root["accessors"][-1]["sparse"]["indices"]["componentType"] == 5125
    assert back[:3].any(axis=1).all()
    assert not back[3:].any()


@pytest.mark.parametrize(
    ("largest", "size", "quantized"), [(0.5, 1.0, True), (1.5, 1.0, False), (0.001, 0.01, False)]
)
def test_fractions_are_used_where_they_are_fine_enough(
    largest: float, size: float, quantized: bool
) -> None:
    root, back = written(np.full((10, 3), largest), True, size)
    assert (root["accessors"][-1]["componentType"] == 5122) == quantized
    assert (QUANTIZATION in root.get("extensionsRequired", [])) == quantized
    assert (QUANTIZATION in root.get("extensionsUsed", [])) == quantized
    assert np.abs(back - largest).max() < 2e-5 * size


def test_an_extension_that_is_there_is_named_once() -> None:
    asset: Asset = ball_asset()
    asset.root["extensionsUsed"] = [QUANTIZATION]
    file = GlbFile(asset.glb())
    deltas = Deltas(Additions(file.document, Draft(file.buffers)), True)
    deltas.positions(np.full((10, 3), 0.5), 1.0)
    assert deltas.extensions(file.document) == {("extensionsRequired",): [QUANTIZATION]}


def test_directions_are_bytes() -> None:
    file = GlbFile(ball_asset().glb())
    deltas = Deltas(Additions(file.document, Draft(file.buffers)), True)
    deltas.directions(np.full((10, 3), 0.25))
    (entries,) = (v for k, v in deltas.additions.edits().items() if k[0] == "accessors")
    assert (entries[0]["componentType"], entries[0]["normalized"]) == (5120, True)
    assert "min" not in entries[0]
