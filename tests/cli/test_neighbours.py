from __future__ import annotations

import json
import zipfile
from io import BytesIO
from pathlib import Path

import pytest
from cli_runs import Run, box, extents

from service.cli.neighbours import gathered, members


@pytest.fixture
def box_gltf(tmp_path: Path) -> Path:
    """A glTF with its buffers beside it."""
    folder = tmp_path / "parts"
    folder.mkdir()
    for name, data in box().export(file_type="gltf").items():
        (folder / name.replace("model", "box")).write_bytes(data)
    return folder / "box.gltf"


def listed(archive: bytes | None) -> list[str]:
    assert archive is not None
    return zipfile.ZipFile(BytesIO(archive)).namelist()


def test_a_gltf_comes_with_its_buffers_and_pictures(box_gltf: Path) -> None:
    document = json.loads(box_gltf.read_bytes())
    document["images"] = [{"uri": "a%20b.png"}, {"uri": "missing.png"}, {"bufferView": 0}]
    document["buffers"] += [{"uri": "data:,x"}, {"uri": "../secret"}, {"uri": "/etc/passwd"}]
    (box_gltf.parent / "a b.png").write_bytes(b"picture")
    (box_gltf.parent.parent / "secret").write_bytes(b"mine")
    buffers = sorted(entry["uri"] for entry in document["buffers"][:2])
    found = gathered(box_gltf, json.dumps(document).encode(), looks=False)
    assert listed(found) == ["box.gltf", "a b.png", *buffers]
    assert found == gathered(box_gltf, json.dumps(document).encode(), looks=False)


def test_an_obj_comes_with_its_looks(tmp_path: Path) -> None:
    path, data = tmp_path / "a.obj", b"mtllib sub/a.mtl\nv 0 0 0\n"
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a.mtl").write_bytes(
        b"newmtl m\nmap_Kd -s 1 1 1 red.png\nmap_Ke blue 1.png\n"
    )
    for name in ("red.png", "blue 1.png"):
        (tmp_path / name).write_bytes(b"picture")
    assert listed(gathered(path, data, looks=True)) == [
        "a.obj",
        "blue 1.png",
        "red.png",
        "sub/a.mtl",
    ]
    assert gathered(path, data, looks=False) is None


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.glb", b"glTF"),
        ("a.gltf", b"{}"),
        ("a.gltf", b"[1]"),
        ("a.gltf", b'{"buffers": [{"uri": 3}]}'),
        ("a.gltf", b'{"buffers": 3}'),
        ("a.gltf", b"\xff"),
        ("a.obj", b"v 0 0 0"),
    ],
)
def test_nothing_is_gathered_for_what_stands_alone(tmp_path: Path, name: str, data: bytes) -> None:
    assert gathered(tmp_path / name, data, looks=True) is None


def test_nothing_is_unpacked_outside_of_its_folder() -> None:
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in ("a.gltf", "../b", "/c", "sub/d", "sub/../../e", "C:/f"):
            archive.writestr(name, b"x")
    assert [name for name, _ in members(buffer.getvalue())] == ["a.gltf", "sub/d"]


def test_an_edited_gltf_lies_in_a_folder_as_it_did(anywhere: Run, box_gltf: Path) -> None:
    folder = box_gltf.parent.parent / "new"
    line = ["edit", box_gltf, "width=1m", "-c", "debug", "-o", f"{folder}/"]
    done = anywhere(*line)
    assert done.exit_code == 0, done.output
    assert f"-> {folder / 'box.gltf'}" in done.stdout
    assert {path.name for path in folder.iterdir()} == {
        path.name for path in box_gltf.parent.iterdir()
    }
    assert extents(folder / "box.gltf") == pytest.approx([1.0, 0.8, 0.5], abs=1e-4)
    again = anywhere(*line)
    assert again.exit_code == 1
    assert "file_exists" in again.stderr


def test_it_comes_as_a_zip_elsewhere_and_never_without_its_files(
    anywhere: Run, box_gltf: Path
) -> None:
    assert anywhere("infer", box_gltf, "-c", "debug").exit_code == 0
    done = anywhere("edit", box_gltf, "width=1m", "-c", "debug")
    assert done.exit_code == 0, done.output
    assert "box.gltf" in listed((box_gltf.parent / "box-edited.zip").read_bytes())
    alone = anywhere("edit", box_gltf, "width=1m", "-c", "debug", "-o", "wide.gltf")
    assert alone.exit_code == 1
    assert "several_files" in alone.stderr
