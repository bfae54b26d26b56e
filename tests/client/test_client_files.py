from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import pytest
import trimesh
from client_app import Script
from provoke import BOX

from service.client import AnswerMalformed, Archive, Edited, File, ShapeClient, add, scale


@pytest.fixture
def client(service_client: httpx.Client) -> ShapeClient:
    return ShapeClient(http=service_client)


@pytest.mark.parametrize(
    ("disposition", "name"),
    [
        ('attachment; filename="a chair.glb"', "a chair.glb"),
        ("attachment; filename=chair.glb", "chair.glb"),
        ("attachment; filename=\"c_.glb\"; filename*=UTF-8''c%C3%A9%20%22.glb", 'cé ".glb'),
        ("attachment; filename*=utf-8''%E6%A4%85.glb; filename=\"x.glb\"", "椅.glb"),
        ('attachment; filename="../../etc/passwd"', "passwd"),
        ("attachment; filename*=UTF-8''..%2F..%2Fetc%2Fpasswd", "passwd"),
        ("attachment; filename*=UTF-8''C%3A%5Cboot.ini", "boot.ini"),
        ("attachment; filename*=UTF-8''a%00%0A.glb", "a.glb"),
        ('attachment; filename=".."', "mesh"),
        ("attachment", "mesh"),
        ("", "mesh"),
    ],
)
def test_a_file_is_called_as_the_service_says_and_lies_in_no_other_folder(
    disposition: str, name: str
) -> None:
    headers = httpx.Headers({"content-disposition": disposition})
    assert File.of(headers, b"", None).filename == name


def test_a_name_goes_there_and_back(client: ShapeClient, chair_glb: bytes, tmp_path: Path) -> None:
    path = tmp_path / "椅子 é.glb"
    path.write_bytes(chair_glb)
    edited = client.edit(path, {"seat_width": scale(1.1)}, category="chair")
    assert edited.filename == "椅子 é-edited.glb"
    assert edited.media_type == "model/gltf-binary"
    assert edited.etag


def test_what_was_written_is_copied(tmp_path: Path) -> None:
    place = tmp_path / "a.glb"
    place.write_bytes(b"mesh")
    file = File("b.glb", "", None, None, place)
    assert file.save(place) == place
    assert file.save(tmp_path / "c.glb").read_bytes() == b"mesh"
    (tmp_path / "folder").mkdir()
    assert file.save(tmp_path / "folder") == tmp_path / "folder/b.glb"


def test_parameters_are_numbers() -> None:
    for told in ("[]", '{"width": "wide"}', "{"):
        with pytest.raises(ValueError, match=r".+"):
            Edited.of(httpx.Headers({"shape-parameters": told}), b"", None)


def test_variants_come_in_a_zip(client: ShapeClient, chair_glb: bytes, tmp_path: Path) -> None:
    edits: list[Any] = [{"seat_width": scale(1.2)}, {"seat_with": 1}, {"leg_height": add(0.1)}]
    archive = client.edit_variants(chair_glb, edits, category="chair", format="ply")
    wide, unknown, high = archive.manifest
    assert [row["index"] for row in archive.manifest] == [0, 1, 2]
    assert [row["file"] for row in archive.manifest] == [
        "variants/000.ply",
        None,
        "variants/002.ply",
    ]
    assert unknown["problem"]["code"] == "unknown_parameter"
    assert wide["edits"] == edits[0]
    assert archive.labels is None
    single = client.edit(chair_glb, edits[2], category="chair", format="ply")
    assert archive.read(high["file"]) == single.data
    after = high["parameters"]["leg_height"]["after"]
    assert after == pytest.approx(single.parameters["leg_height"], abs=1e-6)
    with pytest.raises(KeyError):
        archive.read("variants/001.ply")
    folder = archive.extract(tmp_path / "out")
    assert (folder / "variants/002.ply").read_bytes() == single.data
    assert archive.save(tmp_path).name == "mesh-variants.zip"


def test_draws_come_with_labels(client: ShapeClient, chair_glb: bytes, tmp_path: Path) -> None:
    place = tmp_path / "chairs.zip"
    archive = client.augment(chair_glb, category="chair", count=2, seed=1, strength=0.5, to=place)
    assert archive.content is None
    assert archive.path == place
    labels = archive.labels
    assert labels is not None
    vertices = trimesh.load_mesh(
        Path(archive.extract(tmp_path / "out")) / archive.manifest[1]["file"], process=False
    ).vertices
    assert len(labels["labels"]) == len(vertices)
    assert {labels["parts"][part] for part in labels["labels"]} <= set(labels["parts"])
    assert [row["provenance"]["seed"] for row in archive.manifest] == [1, 1]
    again = client.augment(chair_glb, category="chair", count=2, seed=1, strength=0.5)
    assert again.data == archive.data
    assert again.etag == archive.etag


def test_what_is_no_zip_is_malformed() -> None:
    with pytest.raises(AnswerMalformed, match="it is no zip"):
        Script(httpx.Response(200, content=b"<html>")).client().augment(BOX)


def test_a_zip_without_a_name_is_called_variants() -> None:
    empty = b"PK\x05\x06" + bytes(18)
    archive = Archive.of(httpx.Headers(), empty, None)
    assert archive.filename == "variants.zip"
    with archive.open() as files:
        assert files.namelist() == []
