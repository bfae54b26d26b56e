from __future__ import annotations

import numpy as np
import pytest
from gltf_assets import unpack, values
from mesh_samples import asset

from service.mesh.additions import VERTEX_DATA, Additions, box
from service.mesh.buffers import Draft
from service.mesh.glb import GlbFile

TABLE = np.arange(30, dtype="<f4").reshape(10, 3)


def begin() -> tuple[GlbFile, Additions]:
    file = GlbFile(asset().glb())
    return file, Additions(file.document, Draft(file.buffers))


def written(file: GlbFile, additions: Additions) -> bytes:
    return file.assemble(additions.edits(), additions.draft)[""]


@pytest.mark.parametrize("kind", ["<f4", "<i2", "|i1", "|u1"])
def test_accessors_hold_their_elements(kind: str) -> None:
    file, additions = begin()
    elements = TABLE.astype(kind)
    index = additions.accessor(elements, VERTEX_DATA, **box(elements))
    data = written(file, additions)
    root = unpack(data)[0]
    assert np.array_equal(values(data, index), elements)
    entry = root["accessors"][index]
    view = root["bufferViews"][entry["bufferView"]]
    assert view.get("byteStride", 12) % 4 == view["byteOffset"] % 4 == 0
    assert (entry["min"], entry["max"]) == ([0, 1, 2], [27, 28, 29])


def test_equal_content_is_stored_once() -> None:
    _, additions = begin()
    assert additions.accessor(TABLE) == additions.accessor(TABLE.copy())
    assert additions.accessor(TABLE) != additions.accessor(TABLE + 1)
    assert additions.once("skins", {"joints": [1]}) == additions.once("skins", {"joints": [1]})
    assert additions.add("nodes", {}) != additions.add("nodes", {})


def test_arrays_that_are_not_there_are_made() -> None:
    file, additions = begin()
    assert additions.add("skins", {"joints": [0]}) == 0
    assert additions.add("nodes", {"name": "more"}) == 1
    root = unpack(written(file, additions))[0]
    assert root["skins"] == [{"joints": [0]}]
    assert root["nodes"][1] == {"name": "more"}


def test_nothing_added_is_the_file_itself() -> None:
    file, additions = begin()
    assert written(file, additions) == file.data
