from __future__ import annotations

import base64
import io
import json
import zipfile
from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset, unpack
from mesh_samples import asset, ball, glb, gltf, obj, off, ply, stl

from service.mesh import embedding
from service.mesh.embedding import as_glb
from service.mesh.formats import read_mesh

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


def zipped(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()


def split(pictured: bool = True) -> tuple[dict[str, Any], dict[str, bytes]]:
    """The ball as JSON, a .bin and a picture."""
    made: Asset = asset()
    root = {**made.root, "buffers": [{"byteLength": len(made.chunk), "uri": "ball.bin"}]}
    if pictured:
        root["images"] = [{"uri": "textures/skin.png", "name": "skin"}]
    return root, {"ball.bin": bytes(made.chunk), "textures/skin.png": PIXEL}


def test_a_whole_glb_is_itself() -> None:
    mesh = read_mesh(glb(), "a.glb")
    assert as_glb(mesh, 1.0)[0] is mesh


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.gltf", gltf()), ("a.obj", obj()), ("a.ply", ply()), ("a.stl", stl()), ("a.off", off()),
        ("a.zip", zipped({"a.obj": obj()})),
    ],
)  # fmt: skip
@pytest.mark.parametrize("metres", [1.0, 0.01])
def test_vertices_stay_in_order(name: str, data: bytes, metres: float) -> None:
    mesh = read_mesh(data, name)
    factor = 1.0 if mesh.format == "gltf" else metres
    result, of = as_glb(mesh, metres)
    assert np.allclose(result.vertices, factor * mesh.vertices, rtol=1e-6, atol=1e-9)
    assert np.array_equal(result.faces, mesh.faces)
    assert np.array_equal(of, np.arange(len(mesh.vertices)))


def test_what_only_the_looks_break_is_answered_without(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise IndexError

    monkeypatch.setattr(embedding, "obj_looks", fail)
    mesh = read_mesh(obj(), "a.obj")
    result, of = as_glb(mesh, 1.0)
    assert np.array_equal(result.faces, mesh.faces)
    assert len(of) == len(result.vertices)


def test_what_lies_beside_is_put_into_it() -> None:
    root, files = split()
    mesh = read_mesh(zipped({"ball.gltf": json.dumps(root).encode(), **files}), "a.zip")
    result, _ = as_glb(mesh, 1.0)
    told, _, chunk = unpack(result.data)
    assert np.array_equal(result.vertices, mesh.vertices)
    (image,) = told["images"]
    view = told["bufferViews"][image["bufferView"]]
    assert (image["mimeType"], image["name"]) == ("image/png", "skin")
    assert chunk[view["byteOffset"] :][: view["byteLength"]] == PIXEL
    assert told["buffers"] == [{"byteLength": view["byteOffset"] + len(PIXEL)}]


def test_pictures_in_the_json_move_to_the_chunk() -> None:
    root, _ = split(False)
    made = asset()
    uri = "data:application/octet-stream;base64," + base64.b64encode(made.chunk).decode()
    root["buffers"][0]["uri"] = uri
    root["images"] = [
        {"uri": "data:image/png;base64," + base64.b64encode(PIXEL).decode()},
        {"uri": "data:image/png;base64,!"},
        {"uri": "elsewhere.png"},
    ]
    result, _ = as_glb(read_mesh(json.dumps(root).encode(), "a.gltf"), 1.0)
    first, *others = unpack(result.data)[0]["images"]
    assert first["mimeType"] == "image/png"
    assert others == root["images"][1:]


def test_several_buffers_become_one() -> None:
    vertices, _, _ = ball()
    root, files = split(False)
    root["buffers"].append({"byteLength": 504, "uri": "more.bin"})
    root["bufferViews"].append({"buffer": 1, "byteLength": 504})
    position = root["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    root["accessors"][position]["bufferView"] = len(root["bufferViews"]) - 1
    more = (2 * vertices).astype("<f4").tobytes()
    data = zipped({"ball.gltf": json.dumps(root).encode(), "more.bin": more, **files})
    result, _ = as_glb(read_mesh(data, "a.zip"), 1.0)
    assert np.allclose(result.vertices, 2 * vertices)
    assert len(unpack(result.data)[0]["buffers"]) == 1
