from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
import trimesh
from looks_samples import MEMBERS, MTL, OBJ, picture, shown
from mesh_samples import ball
from numpy.typing import NDArray
from zip_samples import zipped

from service.mesh import limits, objlooks
from service.mesh.accessors import read_accessor
from service.mesh.embedding import as_glb
from service.mesh.formats import read_mesh
from service.mesh.glb import GlbFile


def primitives(file: GlbFile) -> list[dict[str, Any]]:
    (mesh,) = file.document.root["meshes"]
    return list(mesh["primitives"])


def attribute(file: GlbFile, number: int, name: str) -> NDArray[Any]:
    index = primitives(file)[number]["attributes"][name]
    accessor = read_accessor(file.document, file.buffers, index)
    return accessor.decode(accessor.stored(file.buffers))


def materials(file: GlbFile) -> list[str | None]:
    known = file.document.root.get("materials", [])
    return [
        known[entry["material"]]["name"] if "material" in entry else None
        for entry in primitives(file)
    ]


def alone(text: bytes) -> tuple[GlbFile, NDArray[np.int64]]:
    return as_glb(read_mesh(text, "a.obj"), 1.0)


def test_a_primitive_for_each_material() -> None:
    result, of = shown(MEMBERS)
    mesh = read_mesh(OBJ, "a.obj")
    assert materials(result) == [None, "wood", "red"]
    # In the order of first use; the vertex that no face uses comes last.
    assert of.tolist() == [0, 1, 4, 0, 1, 2, 3, 0, 3, 4, 0, 2, 4, 5]
    assert np.array_equal(result.vertices, mesh.vertices[of])
    assert np.array_equal(of[result.faces], mesh.faces[[0, 1, 2, 4, 3]])


def test_corners_keep_what_they_say() -> None:
    result, _ = shown(MEMBERS)
    assert set(primitives(result)[0]["attributes"]) == {"POSITION"}
    wood = [[0, 1], [1, 0.75], [1, 0], [0, 1], [1, 0.75], [1, 0], [0, 1]]
    assert np.allclose(attribute(result, 1, "TEXCOORD_0"), wood)
    straight, slanted = [0, 0, 1], [0, 0.6, 0.8]
    assert np.allclose(attribute(result, 1, "NORMAL"), [straight] * 6 + [slanted])
    assert np.allclose(attribute(result, 2, "NORMAL")[:3], [slanted] * 3)


def test_another_reader_sees_the_same() -> None:
    result, _ = shown(MEMBERS)
    scene = trimesh.load(io.BytesIO(result.data), file_type="glb")
    bare, wood, red = scene.geometry.values()
    assert (len(bare.faces), len(wood.faces), len(red.faces)) == (1, 3, 1)
    # trimesh counts v from below, as the OBJ does.
    assert np.allclose(wood.visual.uv[:3], [[0, 0], [1, 0.25], [1, 1]])
    texture = wood.visual.material.baseColorTexture
    assert np.array_equal(np.asarray(texture.convert("L"))[:2, :2], [[0, 255], [255, 0]])
    assert red.visual.material.baseColorFactor.tolist() == [255, 128, 64, 128]
    assert red.visual.material.alphaMode == "BLEND"


def test_nothing_splits_where_nothing_differs() -> None:
    vertices, faces, normals = ball()
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    rows += [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in normals]
    rows += ["v 7 7 7", *("f " + " ".join(f"{i}//{i}" for i in face) for face in faces + 1)]
    result, of = alone("\n".join(rows).encode())
    assert np.array_equal(of, np.arange(43))
    assert np.array_equal(result.faces, faces)
    assert np.allclose(attribute(result, 0, "NORMAL")[:42], normals, atol=1e-6)


def test_normals_of_the_faces_are_left_to_the_viewer() -> None:
    box = trimesh.creation.box()
    rows = ["v {} {} {}".format(*row) for row in box.vertices]
    rows += ["vn {} {} {}".format(*row) for row in box.face_normals]
    for number, face in enumerate(box.faces + 1, 1):
        rows.append("f " + " ".join(f"{index}//{number}" for index in face))
    result, of = alone("\n".join(rows).encode())
    assert of.tolist() == list(range(8))
    assert set(primitives(result)[0]["attributes"]) == {"POSITION"}
    # But not where one is another.
    rows[8] = "vn 0 0.6 0.8"
    result, of = alone("\n".join(rows).encode())
    assert len(of) > 8
    assert np.array_equal(result.vertices, box.vertices[of])


def test_a_smooth_surface_of_small_faces_keeps_its_normals() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5)
    rows = ["v {:.9g} {:.9g} {:.9g}".format(*row) for row in sphere.vertices]
    rows += ["vn {:.6f} {:.6f} {:.6f}".format(*row) for row in sphere.vertices]
    # One vertex has another normal in one face, as at a crease.
    rows += ["vn {:.6f} {:.6f} {:.6f}".format(*sphere.face_normals[0])]
    faces = ["f " + " ".join(f"{i}//{i}" for i in face) for face in sphere.faces + 1]
    faces[0] = faces[0].rpartition("//")[0] + f"//{len(sphere.vertices) + 1}"
    result, of = alone("\n".join(rows + faces).encode())
    assert len(of) == len(sphere.vertices) + 1
    assert "NORMAL" in primitives(result)[0]["attributes"]


def test_colours_behind_the_coordinates() -> None:
    text = b"v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n"
    result, of = alone(text)
    assert of.tolist() == [0, 1, 2]
    linear = ((0.5 + 0.055) / 1.055) ** 2.4
    assert np.allclose(attribute(result, 0, "COLOR_0")[0], [1, 0, linear], atol=1e-5)
    assert "material" in primitives(result)[0]
    # As bytes; and not where some are missing.
    result, _ = alone(text.replace(b"0.5", b"127.5"))
    assert np.allclose(attribute(result, 0, "COLOR_0")[0], [1 / 255 / 12.92, 0, linear], atol=1e-5)
    result, _ = alone(text.replace(b"1 0 0 0 1 0", b"1 0 0"))
    assert "COLOR_0" not in primitives(result)[0]["attributes"]


def test_parts_in_the_same_places_stay_apart() -> None:
    text = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n"
    result, of = shown({"a.obj": text, "a.mtl": b"newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n"})
    assert of.tolist() == [0, 1, 2, 0, 1, 2]
    assert len(result.vertices) == 6
    assert materials(result) == ["a", "b"]


@pytest.mark.parametrize(
    "members",
    [
        {"looks.mtl": None},
        {"looks.mtl": b""},
        {"looks.mtl": b"\xff\x00\nnewmtl\nKd\nmap_Kd\n" * 3},
        {"looks.mtl": bytes(1 << 16)},
        {"looks.mtl": MTL.replace(b"newmtl ", b"newmtl other ")},
    ],
)
def test_without_materials_there_is_the_shape(members: dict[str, bytes | None]) -> None:
    files = {name: data for name, data in {**MEMBERS, **members}.items() if data is not None}
    result, of = shown(files)
    mesh = read_mesh(OBJ, "a.obj")
    assert materials(result) == [None]
    assert np.array_equal(of[result.faces], mesh.faces)
    assert np.array_equal(result.vertices, mesh.vertices[of])


@pytest.mark.parametrize(
    "text",
    [
        OBJ.replace(b"4/1/1", b"4/99/1"),
        OBJ.replace(b"4/1/1", b"4/-99/1"),
        OBJ.replace(b"4/1/1", b"4/0/1"),
        OBJ.replace(b"4/1/1", b"4/x/1"),
        OBJ.replace(b"vt 0 0", b"vt"),
        OBJ.replace(b"vt 0 0", b"vt 1"),
        OBJ.replace(b"vt 0 0", b"vt nan inf"),
        OBJ.replace(b"vt 0 0", b"vt one two"),
        OBJ.replace(b"vn 0 0 1", b"vn nan 0 1"),
        OBJ.replace(b"vn 0 0 1", b"vn 0 0 0"),
        OBJ.replace(b"vn 0 0 1", b"vn 1e308 1e308 1e308"),
        OBJ.replace(b"usemtl red", b"usemtl \xff\xfe\x00"),
        OBJ.replace(b"usemtl red", b"usemtl"),
        OBJ.replace(b"mtllib looks.mtl", b"mtllib ../looks.mtl /etc/passwd \0"),
        OBJ.replace(b"mtllib looks.mtl", b"mtllib"),
        OBJ.replace(b"\n", b"\r"),
        OBJ.replace(b"\n", b"\r\n"),
    ],
)
def test_broken_looks_are_left_out(text: bytes) -> None:
    result, of = shown({**MEMBERS, "looks.obj": text})
    mesh = read_mesh(zipped({"looks.obj": text}), "a.zip")
    assert np.array_equal(result.vertices, mesh.vertices[of])
    assert sorted(map(tuple, of[result.faces])) == sorted(map(tuple, mesh.faces))
    for number, entry in enumerate(primitives(result)):
        for name in entry["attributes"]:
            assert np.isfinite(attribute(result, number, name)).all()
        if "NORMAL" in entry["attributes"]:
            lengths = np.linalg.norm(attribute(result, number, "NORMAL"), axis=1)
            assert np.allclose(lengths, 1.0, atol=1e-5)


def test_too_many_materials_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(objlooks, "MATERIALS", 2)
    assert materials(shown(MEMBERS)[0]) == [None]
    monkeypatch.setattr(objlooks, "MATERIALS", 3)
    assert len(materials(shown(MEMBERS)[0])) == 3
    monkeypatch.setattr(objlooks, "SWITCHES", 2)
    assert materials(shown(MEMBERS)[0]) == [None]


def test_too_many_vertices_come_without_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = read_mesh(zipped(MEMBERS), "a.zip")
    monkeypatch.setattr(limits, "VERTICES", 13)
    result, of = as_glb(mesh, 1.0)
    assert of.tolist() == list(range(6))
    assert np.array_equal(result.faces, mesh.faces)


def test_materials_may_lie_elsewhere_in_the_folder() -> None:
    files = {
        "a/looks.obj": OBJ.replace(b"looks.mtl", b"C:\\work\\My Looks.MTL"),
        "a/deep/my looks.mtl": MTL.replace(b"checker.png", b"..\\textures\\Checker.PNG"),
        "a/deep/checker.png": picture(),
        "secret.mtl": MTL,
    }
    result, _ = shown(files)
    assert materials(result) == [None, "wood", "red"]
    assert len(result.document.root["images"]) == 1
    files["a/looks.obj"] = OBJ.replace(b"looks.mtl", b"../secret.mtl")
    assert materials(shown(files)[0]) == [None]
