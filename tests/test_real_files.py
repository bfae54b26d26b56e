"""Files as real tools wrote them, where the folder with them lies beside the checkout.

A sample is taken, or all of them with REAL_FILES=all.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.errors import UnsupportedFormat
from service.mesh.formats import read_mesh

DATA = Path(__file__).parents[2] / "shared" / "data"
EVERY = os.environ.get("REAL_FILES") == "all"
LARGEST = 1 << 30 if EVERY else 1_500_000
MOVING = ("POSITION", "NORMAL", "TANGENT")
TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

Document = dict[str, Any]


def sampled(pattern: str, step: int) -> list[Path]:
    paths = [path for path in sorted(DATA.glob(pattern)) if path.stat().st_size < LARGEST]
    return paths[:: 1 if EVERY else step]


GLBS = (
    sampled("chairs/originals/*/*.glb", 3)
    + sampled("airplanes/originals/**/*.glb", 4)
    + sampled("humans/meshes/*.glb", 12)
)
OBJS = sampled("chairs/originals/*/*.obj", 3)
GLTFS = sampled("chairs/originals/*/*.gltf", 1)
SCENES = sampled("chairs/originals/*/*.DAE", 1)


def named(path: Path) -> str:
    return f"{path.parent.name}/{path.stem}"


def wider(data: bytes, name: str) -> bytes:
    """The file stretched along x and bent, and its empty edit checked on the way."""
    mesh = read_mesh(data, name)
    count = len(mesh.vertices)
    linear = np.tile(np.eye(3), (count, 1, 1))
    assert mesh.write(mesh.vertices.copy(), linear) is data
    linear[:, 0, 0], linear[:, 0, 1] = 1.25, 0.125
    new = np.einsum("vij,vj->vi", linear, mesh.vertices)
    written = mesh.write(new, linear)
    again = read_mesh(written, name)
    assert np.array_equal(again.faces, mesh.faces)
    # What a skin of integer weights or a position of few bits rounds.
    assert np.abs(again.vertices - new).max() <= 2e-6 * np.abs(new).max()
    return written


def parts(data: bytes) -> tuple[Document, list[bytes]]:
    """JSON and binary chunk of a GLB, read independently of the service."""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), [data[28 + length :]]


def digests(document: Document, buffers: list[bytes], indices: set[int]) -> dict[int, str]:
    """SHA-256 of the elements of each of some accessors."""
    found = {}
    for index in indices:
        entry = document["accessors"][index]
        dtype, width = np.dtype("<" + TYPES[entry["componentType"]]), WIDTHS[entry["type"]]
        elements = np.zeros((entry["count"], width), dtype)
        if "bufferView" in entry:
            view = document["bufferViews"][entry["bufferView"]]
            at = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
            strides = (view.get("byteStride", dtype.itemsize * width), dtype.itemsize)
            elements = np.ndarray(elements.shape, dtype, buffers[view["buffer"]], at, strides)
        found[index] = hashlib.sha256(elements.tobytes()).hexdigest()
    return found


def primitives(document: Document) -> Iterator[Document]:
    for mesh in document.get("meshes", []):
        yield from mesh["primitives"]


def check_documents(
    before: Document, after: Document, old: list[bytes], new: list[bytes], pictures: list[int]
) -> None:
    """Whether two glTF documents differ in moved geometry alone; appended copies are allowed."""
    moving = {
        p["attributes"][n] for p in primitives(before) for n in MOVING if n in p["attributes"]
    }
    kept = set(range(len(before.get("accessors", [])))) - moving
    assert digests(before, old, kept) == digests(after, new, kept)
    for number in pictures:
        one, other = before["bufferViews"][number], after["bufferViews"][number]
        assert one == other
        start, length = one.get("byteOffset", 0), one["byteLength"]
        assert (
            old[one["buffer"]][start : start + length] == new[one["buffer"]][start : start + length]
        )
    assert before.keys() == after.keys()
    for key in before.keys() - {"accessors", "bufferViews", "buffers", "meshes", "nodes"}:
        assert before[key] == after[key], key
    for index, entry in enumerate(before["accessors"]):
        bare = [
            {k: v for k, v in e.items() if k not in ("min", "max")}
            for e in (entry, after["accessors"][index])
        ]
        assert bare[0] == bare[1]
        assert index in moving or entry == after["accessors"][index]
    for key in ("bufferViews", "meshes"):
        assert after[key][: len(before[key])] == before[key]
    # Instances that no longer look alike get a mesh each; all else of a node stays.
    for one, other in zip(before["nodes"], after["nodes"], strict=True):
        assert {**one, "mesh": 0} == {**other, "mesh": 0}


@pytest.mark.parametrize("path", GLBS, ids=named)
def test_glb_files_differ_in_moved_geometry_alone(path: Path) -> None:
    data = path.read_bytes()
    (before, old), (after, new) = parts(data), parts(wider(data, path.name))
    pictures = [i["bufferView"] for i in before.get("images", []) if "bufferView" in i]
    check_documents(before, after, old, new, pictures)


@pytest.mark.parametrize("path", OBJS, ids=named)
def test_obj_files_differ_in_numbers_of_vertices_and_normals_alone(path: Path) -> None:
    data = path.read_bytes()
    check_lines(data, wider(data, path.name))


def check_lines(data: bytes, written: bytes) -> None:
    lines = zip(data.split(b"\n"), written.split(b"\n"), strict=True)
    changed = [(old, new) for old, new in lines if old != new]
    assert changed
    for old, new in changed:
        assert old.split()[0] == new.split()[0]
        assert old.split()[0] in (b"v", b"vn")
        assert old.split()[4:] == new.split()[4:]


def archived(path: Path) -> bytes:
    """The folder of a file, zipped as a shop would."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for member in sorted(path.parent.rglob("*")):
            if member.is_file():
                archive.write(member, member.relative_to(path.parent))
    return target.getvalue()


@pytest.mark.parametrize("path", OBJS + GLTFS, ids=named)
def test_archives_differ_in_moved_geometry_alone(path: Path) -> None:
    data = archived(path)
    files = [zipfile.ZipFile(io.BytesIO(d)) for d in (data, wider(data, "model.zip"))]
    before, after = ({name: file.read(name) for name in file.namelist()} for file in files)
    assert list(before) == list(after)
    for one, other in zip(files[0].infolist(), files[1].infolist(), strict=True):
        assert (one.date_time, one.compress_type, one.external_attr, one.extra) == (
            other.date_time, other.compress_type, other.external_attr, other.extra,
        )  # fmt: skip
    changed = {name for name in before if before[name] != after[name]}
    if path.suffix == ".obj":
        assert changed == {path.name}
        check_lines(before[path.name], after[path.name])
        return
    one, other = (json.loads(members[path.name]) for members in (before, after))
    uris = [buffer["uri"] for buffer in one["buffers"]]
    assert changed == {path.name, *uris}
    check_documents(one, other, [before[u] for u in uris], [after[u] for u in uris], [])


@pytest.mark.parametrize("path", SCENES, ids=named)
def test_scenes_of_a_format_that_is_not_read_are_refused_with_a_way_out(path: Path) -> None:
    with pytest.raises(UnsupportedFormat, match="unsupported_format") as caught:
        read_mesh(path.read_bytes(), path.name)
    assert "export GLB" in caught.value.suggestion
