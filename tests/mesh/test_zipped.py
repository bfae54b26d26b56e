from __future__ import annotations

import json
import zipfile
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_samples import SAMPLES, asset, ball, bend, bend_some, still
from zip_samples import gltf_members, members, obj_members, zipped

from service.errors import ShapeError, UnsupportedFormat
from service.mesh.formats import READERS, read_mesh
from service.mesh.zipped import mesh_member

VERTICES, FACES, NORMALS = ball()


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_mesh_in_an_archive_is_the_mesh(sample: str) -> None:
    format = sample.partition("-")[0]
    plain = read_mesh(SAMPLES[sample], "x." + format)
    data = zipped({"readme.txt": b"hello", f"ball.{format.upper()}": SAMPLES[sample]})
    mesh = read_mesh(data, "ball.zip")
    assert (mesh.format, mesh.suffix, mesh.media_type) == (format, "zip", "application/zip")
    assert np.array_equal(mesh.vertices, plain.vertices)
    assert np.array_equal(mesh.faces, plain.faces)
    new, linear = bend(mesh.vertices)
    written = members(mesh.write(new, linear))
    assert written == {
        "readme.txt": b"hello",
        f"ball.{format.upper()}": plain.write(new, linear),
    }


@pytest.mark.parametrize("contents", [obj_members(), gltf_members()], ids=["obj", "gltf"])
@pytest.mark.parametrize("streamed", [False, True])
def test_standing_still_answers_the_archive_itself(
    contents: dict[str, bytes], streamed: bool
) -> None:
    mesh = read_mesh(zipped(contents, comment=b"from a shop", streamed=streamed))
    assert mesh.write(mesh.vertices.copy(), still(len(mesh.vertices))) is mesh.data


def test_only_the_member_with_the_geometry_changes() -> None:
    mesh = read_mesh(zipped(obj_members()))
    written = members(mesh.write(*bend(mesh.vertices)))
    assert [n for n, content in written.items() if content != obj_members()[n]] == [
        "chair/ball.obj"
    ]
    assert list(written) == list(obj_members())


@pytest.mark.parametrize(
    ("uri", "file"),
    [("scene.bin", "scene.bin"), ("./a%20b/c.bin", "a b/c.bin"), ("a b/c.bin", "a b/c.bin")],
)
def test_buffers_of_a_gltf_are_members_too(uri: str, file: str) -> None:
    contents = gltf_members(uri, file)
    mesh = read_mesh(zipped(contents), "model.zip")
    assert np.array_equal(mesh.vertices, VERTICES)
    new, linear, moved = bend_some(mesh.vertices)
    written = members(mesh.write(new, linear))
    assert {n for n, content in written.items() if content != contents[n]} == {"scene.gltf", file}
    before, after = (json.loads(c["scene.gltf"]) for c in (contents, written))
    for bound in ("min", "max"):
        del before["accessors"][0][bound], after["accessors"][0][bound]
        del before["accessors"][1][bound], after["accessors"][1][bound]
    assert after == before
    size = 12 * len(VERTICES)
    stored = np.frombuffer(written[file][:size], "<f4").reshape(-1, 3)
    assert np.array_equal(stored, new.astype("<f4"))
    assert written[file][2 * size :] == contents[file][2 * size :]
    normals = [np.frombuffer(c[file][size : 2 * size], "<f4") for c in (contents, written)]
    assert np.array_equal(*(n.reshape(-1, 3)[~moved] for n in normals))


def test_a_buffer_that_grows_takes_the_room_of_what_it_needs() -> None:
    built = asset()
    # Two nodes of one mesh that move apart need positions of their own.
    built.node(mesh=0, translation=[3, 0, 0])
    root = {**built.root, "buffers": [{"uri": "a.bin", **built.root["buffers"][0]}]}
    mesh = read_mesh(zipped({"a.gltf": json.dumps(root).encode(), "a.bin": bytes(built.chunk)}))
    new = mesh.vertices.copy()
    new[:42] *= 1.5
    written = mesh.write(new, still(84))
    assert len(members(written)["a.bin"]) == len(built.chunk) + 42 * 12
    again = read_mesh(written)
    assert np.allclose(again.vertices, new, atol=1e-6)


def gltf(buffers: list[Any]) -> bytes:
    built = asset()
    return json.dumps({**built.root, "buffers": buffers}).encode()


LENGTH = len(asset().chunk)
CHUNK = bytes(asset().chunk)


@pytest.mark.parametrize(
    ("contents", "code"),
    [
        ({}, "archive_without_mesh"),
        ({"a.txt": b"x", "b.fbx": b"x"}, "archive_without_mesh"),
        ({"__MACOSX/._a.obj": b"x"}, "archive_without_mesh"),
        ({"inner.zip": b"PK"}, "nested_archive"),
        ({"a.obj": b"", "b/c.stl": b""}, "several_meshes"),
        ({"a.obj": b"v 1\n"}, "malformed_obj"),
        ({"a.gltf": gltf([{"byteLength": LENGTH, "uri": "a.bin"}])}, "missing_buffer"),
        (
            {"a.bin": CHUNK, "b/a.gltf": gltf([{"byteLength": LENGTH, "uri": "../a.bin"}])},
            "external_buffers",
        ),
        (
            {"a.bin": b"short", "a.gltf": gltf([{"byteLength": LENGTH, "uri": "a.bin"}])},
            "malformed_gltf",
        ),
    ],
)
def test_archives_that_are_of_no_use_say_why(contents: dict[str, bytes], code: str) -> None:
    with pytest.raises(ShapeError) as caught:
        read_mesh(zipped(contents), "x.zip")
    assert caught.value.code == code
    assert caught.value.suggestion


def test_two_buffers_in_one_file_are_refused() -> None:
    entry = {"byteLength": LENGTH, "uri": "a.bin"}
    root = json.loads(gltf([entry, entry]))
    root["bufferViews"][1]["buffer"] = 1
    with pytest.raises(UnsupportedFormat, match="shared_buffer_file"):
        read_mesh(zipped({"a.bin": CHUNK, "a.gltf": json.dumps(root).encode()}))


def test_meshes_are_named_when_there_are_several() -> None:
    names = [f"part{number}.obj" for number in range(9)]
    with pytest.raises(UnsupportedFormat) as caught:
        mesh_member(names, READERS)
    assert "9 meshes: 'part0.obj', 'part1.obj'" in caught.value.detail
    assert "part7" not in caught.value.detail


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
@settings(max_examples=100, deadline=None, database=None)
@given(data=st.data())
def test_damaged_archives_raise_shape_errors_alone(method: int, data: st.DataObject) -> None:
    content = bytearray(zipped(gltf_members(), method))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 6))] = data.draw(st.binary(max_size=6))
    cause = None
    try:
        mesh = read_mesh(bytes(content), "x.zip")
        mesh.write(*bend(mesh.vertices))
    except ShapeError as error:
        cause = error.__cause__
    assert cause is None, "a reader let damage through to the last resort"
