from __future__ import annotations

import struct
import sys

import numpy as np
import pytest
from mesh_samples import asset, ball, still

from service.errors import InvalidRequest
from service.mesh.convert import convert
from service.mesh.formats import READERS, read_mesh

VERTICES, FACES, _ = ball()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 4e5])
@pytest.mark.parametrize("format", READERS)
def test_vertices_and_faces_arrive_in_order(format: str, scale: float) -> None:
    # One vertex that no face uses must not be lost.
    vertices = np.concatenate([VERTICES, [[0.5, 0.5, 0.5]]]) * scale
    again = read_mesh(convert(vertices, FACES, format), "x." + format)
    assert np.allclose(again.vertices[again.faces], vertices[FACES], rtol=1e-6, atol=1e-6 * scale)
    if format != "stl":
        assert np.array_equal(again.faces, FACES)
        assert np.allclose(again.vertices, vertices, rtol=1e-6, atol=1e-6 * scale)


@pytest.mark.parametrize("format", READERS)
def test_pictures_are_never_opened(format: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # What a picture of a few bytes claims to be: a file whose pixels need gigabytes.
    size = struct.pack(">2I5B", 50_000, 50_000, 8, 6, 0, 0, 0)
    picture = b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + size + bytes(20)
    built = asset()
    built.root["images"] = [{"bufferView": built.view(picture), "mimeType": "image/png"}]
    built.root["textures"] = [{"source": 0}]
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    built.root["materials"] = [material]
    built.root["meshes"][0]["primitives"][0]["material"] = 0
    for name in ("PIL", "PIL.Image"):
        monkeypatch.setitem(sys.modules, name, None)
    mesh = read_mesh(built.glb())
    written = convert(mesh.vertices, mesh.faces, format)
    assert b"IHDR" not in written
    assert b"IHDR" in mesh.write(mesh.vertices * 2, still(len(mesh.vertices)))


def test_other_formats_are_refused() -> None:
    with pytest.raises(InvalidRequest) as caught:
        convert(VERTICES, FACES, "fbx")
    assert caught.value.code == "unknown_format"
    assert "glb" in caught.value.suggestion
