from __future__ import annotations

import base64
import copy
import json
from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_samples import ball, bend, gltf, still

from service.errors import ShapeError, UnsupportedFormat
from service.mesh.formats import read_mesh

VERTICES, FACES, NORMALS = ball()
GLTF = gltf()


def buffer(data: bytes) -> bytes:
    return base64.b64decode(json.loads(data)["buffers"][0]["uri"].partition(",")[2])


def test_embedded_buffers_are_rewritten_in_place() -> None:
    mesh = read_mesh(GLTF, "ball.gltf")
    new, linear = bend(mesh.vertices)
    written = mesh.write(new, linear)
    after = buffer(written)
    assert np.array_equal(np.frombuffer(after, "<f4", 126).reshape(-1, 3), new.astype("<f4"))
    assert after[2 * 504 :] == buffer(GLTF)[2 * 504 :]
    head = GLTF.index(b'"uri": "') + 8
    tail = GLTF.index(b'"', head)
    assert written[written.index(b'"', written.index(b'"uri": "') + 8) :] == GLTF[tail:]
    assert written[: GLTF.index(b'"accessors"')] == GLTF[: GLTF.index(b'"accessors"')]


def test_layout_and_byte_order_mark_stay() -> None:
    text = b"\xef\xbb\xbf" + json.dumps(json.loads(GLTF), indent="\t").encode() + b"\r\n"
    mesh = read_mesh(text)
    new = mesh.vertices.copy()
    inside = int(np.argmin(np.abs(new - new.mean(axis=0)).max(axis=1)))
    new[inside] += 0.0625
    written = mesh.write(new, still(len(new)))
    assert len(written) == len(text)
    different = [i for i, (a, b) in enumerate(zip(text, written, strict=True)) if a != b]
    uri = text.index(b"base64,")
    assert different
    assert all(uri < at < uri + 700 for at in different)


def test_other_files_are_refused_only_if_the_geometry_is_there() -> None:
    root = json.loads(GLTF)
    root["images"] = [{"uri": "wood.png"}]
    root["buffers"].append({"uri": "animation.bin", "byteLength": 4})
    root["bufferViews"].append({"buffer": 1, "byteLength": 4})
    assert np.array_equal(read_mesh(json.dumps(root).encode()).vertices, VERTICES)
    root["bufferViews"][0]["buffer"] = 1
    with pytest.raises(UnsupportedFormat, match=r"external_buffers.*animation\.bin"):
        read_mesh(json.dumps(root).encode())


def test_floats_that_the_json_holds_are_those_of_the_buffer() -> None:
    mesh = read_mesh(GLTF)
    written = mesh.write(mesh.vertices * 1.1, still(len(VERTICES)))
    entry = json.loads(written)["accessors"][0]
    stored = (VERTICES * 1.1).astype("<f4")
    assert entry["min"] == stored.min(axis=0).tolist()
    assert entry["max"] == stored.max(axis=0).tolist()


def rich() -> Asset:
    """An asset with something of everything: skin, sparse and morphed parts, instances."""
    points, normals = VERTICES.astype("<f4"), NORMALS.astype("<f4")
    asset = Asset()
    indices = asset.accessor(FACES.reshape(-1).astype("u1"))
    plain = {"POSITION": asset.accessor(points), "NORMAL": asset.accessor(normals)}
    sparse = {"POSITION": asset.sparse(np.array([2, 5], "u1"), points[:2], base=points)}
    skinned = {
        "POSITION": asset.accessor(np.rint(points * 50).astype("i1")),
        "JOINTS_0": asset.accessor(np.zeros((len(points), 4), "u1")),
        "WEIGHTS_0": asset.accessor(np.full((len(points), 4), 255, "u1"), normalized=True),
    }
    morphed = {"attributes": plain, "indices": indices, "targets": [{"POSITION": 0}]}
    mesh = asset.mesh(morphed, {"attributes": sparse, "indices": indices, "mode": 5})
    body = asset.mesh({"attributes": skinned, "indices": indices, "mode": 6})
    leaf = asset.node(root=False, mesh=mesh, matrix=np.diag([1, 2, 3, 1]).reshape(-1).tolist())
    joint = asset.node(mesh=mesh, rotation=[0, 0, 0.6, 0.8], scale=[1, 1, 2], children=[leaf])
    asset.node(mesh=body, skin=0, translation=[1, 2, 3])
    binds = asset.accessor(np.eye(4, dtype="<f4").reshape(1, 16))
    asset.root["skins"] = [{"joints": [joint], "inverseBindMatrices": binds}]
    asset.root["animations"] = [{"samplers": [{"input": 1, "output": 0}], "channels": []}]
    asset.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    return asset


JUNK = [None, True, -1, 0, 1, 2, 5, 300, 5121, 5126, 2**31, 2**53, 1e300, 0.5, "", "POSITION",
        "data:;base64,", [], [0], [[]], {}, {"a": 1}, {"POSITION": 0}]  # fmt: skip


@settings(max_examples=300, deadline=None, database=None)
@given(data=st.data())
def test_damaged_documents_raise_shape_errors_alone(data: st.DataObject) -> None:
    root = json.loads(rich().gltf())
    for _ in range(data.draw(st.integers(1, 3))):
        owner: Any = root
        key = data.draw(st.sampled_from(sorted(owner)))
        while isinstance(owner[key], dict | list) and owner[key] and data.draw(st.integers(0, 5)):
            owner = owner[key]
            key = data.draw(st.sampled_from(sorted(owner) if isinstance(owner, dict)
                                            else range(len(owner))))  # fmt: skip
        if data.draw(st.booleans()):
            owner[key] = copy.deepcopy(data.draw(st.sampled_from(JUNK)))
        else:
            del owner[key]
        if not root:
            return
    try:
        mesh = read_mesh(json.dumps(root).encode(), "x.gltf")
        written = mesh.write(*bend(mesh.vertices))
        again = read_mesh(written, "x.gltf")
    except ShapeError as error:
        cause = error.__cause__
    else:
        cause = None
        assert np.array_equal(again.faces, mesh.faces)
    assert cause is None, "a reader let damage through to the last resort"


def test_an_asset_of_everything_moves_and_splits() -> None:
    mesh = read_mesh(rich().gltf())
    new, linear = bend(mesh.vertices)
    again = read_mesh(mesh.write(new, linear))
    # Twice as much as the quantised part rounds, though it became float where it had to.
    assert np.allclose(again.vertices, new, atol=0.03)
    assert np.array_equal(again.faces, mesh.faces)


def test_turning_what_has_no_normals_is_the_same_file() -> None:
    asset = Asset()
    position = asset.accessor(VERTICES.astype("<f4"))
    indices = asset.accessor(FACES.reshape(-1).astype("u1"))
    asset.node(mesh=asset.mesh({"attributes": {"POSITION": position}, "indices": indices}))
    mesh = read_mesh(asset.gltf())
    assert mesh.write(mesh.vertices, 2 * still(len(VERTICES))) is mesh.data
