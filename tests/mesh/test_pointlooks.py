from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gltf_assets import unpack
from looks_samples import picture
from mesh_samples import ball, off, ply
from numpy.typing import NDArray
from zip_samples import zipped

from service.mesh.accessors import read_accessor
from service.mesh.embedding import as_glb
from service.mesh.formats import read_mesh

NAMES = ("POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0")


def looks(data: bytes, name: str) -> dict[str, NDArray[Any]]:
    """What the GLB of a file says of its vertices."""
    mesh = read_mesh(data, name)
    result, of = as_glb(mesh, 1.0)
    assert np.array_equal(of, np.arange(len(mesh.vertices)))
    assert np.array_equal(result.faces, mesh.faces)
    (primitive,) = result.document.root["meshes"][0]["primitives"]
    found = {}
    for attribute in NAMES:
        if attribute in primitive["attributes"]:
            index = primitive["attributes"][attribute]
            accessor = read_accessor(result.document, result.buffers, index)
            found[attribute] = accessor.decode(accessor.stored(result.buffers))
    return found


def triangle(properties: str, rows: str, comment: str = "x") -> bytes:
    """A triangle as a PLY in ASCII with some more properties."""
    places = ("0 0 0", "1 0 0", "0 1 0")
    lines = zip(places, rows.split("/"), strict=True)
    text = f"ply\nformat ascii 1.0\ncomment {comment}\nelement vertex 3\nproperty float x\n"
    text += "property float y\nproperty float z\n"
    text += "".join(f"property {p}\n" for p in properties.split(","))
    text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    return (text + "".join(f"{a} {b}\n" for a, b in lines) + "3 0 1 2\n").encode()


RED = "{0} red,{0} green,{0} blue"


@pytest.mark.parametrize("order", ["", "<", ">"])
def test_normals(order: str) -> None:
    found = looks(ply(order), "a.ply")
    assert set(found) == {"POSITION", "NORMAL"}
    assert np.allclose(found["NORMAL"], ball()[2], atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "rows"),
    [
        ("uchar", "255 0 51/0 255 0/0 0 255"),
        ("ushort", "65535 0 13107/0 65535 0/0 0 65535"),
        ("float", "1 0 0.2/0 1 0/0 0 1"),
        ("float", "255 0 51/0 255 0/0 0 255"),
    ],
)
def test_colours(kind: str, rows: str) -> None:
    found = looks(triangle(RED.format(kind), rows), "a.ply")
    expected = [[1, 0, 0.0331048], [0, 1, 0], [0, 0, 1]]
    assert np.allclose(found["COLOR_0"], expected, atol=1e-4)


def test_dark_bytes_are_no_shares() -> None:
    found = looks(triangle(RED.format("uchar"), "1 0 1/0 1 0/0 0 1"), "a.ply")
    assert 0 < found["COLOR_0"].max() < 0.001


def test_alpha_is_blended() -> None:
    data = triangle(RED.format("uchar") + ",uchar alpha", "9 9 9 255/9 9 9 0/9 9 9 51")
    assert np.allclose(looks(data, "a.ply")["COLOR_0"][:, 3], [1, 0, 0.2], atol=1e-4)
    (material,) = as_glb(read_mesh(data, "a.ply"), 1.0)[0].document.root["materials"]
    assert material["alphaMode"] == "BLEND"
    opaque = (
        data.replace(b" 0\n1", b" 255\n1").replace(b"9 0\n", b"9 255\n").replace(b" 51", b" 255")
    )
    assert looks(opaque, "a.ply")["COLOR_0"].shape == (3, 3)


@pytest.mark.parametrize("names", ["s,t", "u,v", "texture_u,texture_v"])
def test_coordinates_and_their_picture(names: str) -> None:
    u, v = names.split(",")
    data = triangle(f"float {u},float {v}", "0 0/1 0.25/nan 1", "TextureFile my wood.png")
    found = looks(data, "a.ply")
    assert np.allclose(found["TEXCOORD_0"], [[0, 1], [1, 0.75], [0, 0]])
    members = {"a.ply": data, "my wood.png": picture()}
    root, _, _ = unpack(as_glb(read_mesh(zipped(members), "a.zip"), 1.0)[0].data)
    assert root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    del members["my wood.png"]
    root, _, _ = unpack(as_glb(read_mesh(zipped(members), "a.zip"), 1.0)[0].data)
    assert "materials" not in root


def test_a_normal_that_is_none_is_that_of_the_faces() -> None:
    data = triangle("float nx,float ny,float nz", "0 3 4/nan 0 0/0 0 0")
    expected = [[0, 0.6, 0.8], [0, 0, 1], [0, 0, 1]]
    assert np.allclose(looks(data, "a.ply")["NORMAL"], expected)
    nothing = triangle("float nx,float ny,float nz", "nan 0 0/nan 0 0/nan 0 0")
    assert "NORMAL" not in looks(nothing, "a.ply")


def test_off_colours_and_normals() -> None:
    found = looks(off("COFF"), "a.off")
    assert np.allclose(found["COLOR_0"], [[1, 0.2158605, 0]] * 42, atol=1e-4)
    assert np.allclose(looks(off("NOFF"), "a.off")["NORMAL"], ball()[2], atol=1e-6)
    assert set(looks(off(), "a.off")) == {"POSITION"}


def test_off_of_everything() -> None:
    rows = "0 0 0 0 0 1 1 0 0 0.5 0.25 1\n1 0 0 0 0 1 1 0 0 1 0 0\n0 1 0 0 0 1 1 0 0 1 0 0\n"
    found = looks(f"STCNOFF 3 1 0\n{rows}3 0 1 2\n".encode(), "a.off")
    assert set(found) == set(NAMES)
    assert np.allclose(found["COLOR_0"][0], [1, 0, 0, 0.5], atol=1e-4)
    assert np.allclose(found["TEXCOORD_0"][0], [0.25, 0])


def test_off_with_fewer_colours_than_it_says() -> None:
    text = b"COFF 3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0\n3 0 1 2\n"
    assert set(looks(text, "a.off")) == {"POSITION"}
