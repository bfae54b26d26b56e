from __future__ import annotations

import pytest
from zip_samples import zipped

from service.errors import InvalidMesh, UnsupportedFormat
from service.mesh.archive import Archive
from service.mesh.folder import Folder

NAMES = ["top.bin", "a/scene.gltf", "a/scene.bin", "a/b c/d.bin", "a/50%.bin"]
FOLDER = Folder(Archive(zipped({name: name.encode() for name in NAMES})), "a/scene.gltf")


@pytest.mark.parametrize(
    ("uri", "name"),
    [
        ("scene.bin", "a/scene.bin"),
        ("./scene.bin", "a/scene.bin"),
        ("b%20c/d.bin", "a/b c/d.bin"),
        ("b c//d.bin", "a/b c/d.bin"),
        ("b c\\d.bin", "a/b c/d.bin"),
        ("50%.bin", "a/50%.bin"),
        ("50%25.bin", "a/50%.bin"),
    ],
)
def test_references_start_from_the_file(uri: str, name: str) -> None:
    assert FOLDER.locate(uri) == name
    assert FOLDER.read(name) == name.encode()


@pytest.mark.parametrize(
    "uri",
    [
        "../top.bin",
        "b c/../../top.bin",
        "%2e%2e/top.bin",
        "..%5ctop.bin",
        "/etc/passwd",
        "%2Fetc%2Fpasswd",
        "C:\\scene.bin",
        "file:///etc/passwd",
        "http://localhost/scene.bin",
        "//localhost/scene.bin",
        "",
    ],
)
def test_nothing_outside_of_the_folder_is_reached(uri: str) -> None:
    with pytest.raises(UnsupportedFormat, match="external_buffers"):
        FOLDER.locate(uri)


@pytest.mark.parametrize("uri", ["other.bin", "b c", ".", "SCENE.bin"])
def test_what_is_not_there_is_named(uri: str) -> None:
    with pytest.raises(InvalidMesh) as caught:
        FOLDER.locate(uri)
    assert caught.value.code == "missing_buffer"
    assert uri in caught.value.detail


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("b c/d.bin", "a/b c/d.bin"),
        ("C:\\work\\D.BIN", "a/b c/d.bin"),
        ("../x/Scene.bin", "a/scene.bin"),
        ("/abs/b%20c/50%25.bin", "a/50%.bin"),
        ("top.bin", None),
        ("../top.bin", None),
        ("..", None),
        ("", None),
        (" ", None),
        ("scene.bin\0", None),
    ],
)
def test_what_another_machine_wrote_is_found_by_its_name(path: str, name: str | None) -> None:
    assert FOLDER.find(path) == name


def test_a_name_that_is_there_twice_means_neither() -> None:
    files = {"a.obj": b"", "x/t.png": b"1", "y/T.png": b"2"}
    folder = Folder(Archive(zipped(files)), "a.obj")
    assert folder.find("z/t.png") is None
    assert folder.find("y/T.png") == "y/T.png"
    assert folder.content("y/T.png", 1) == b"2"
    assert folder.content("y/T.png", 0) is None
