"""Files that a mesh file names beside it: buffers, materials, pictures.  They go along in a zip."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

LIBRARY = re.compile(rb"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
PICTURE = re.compile(rb"^[ \t]*(?:map_\w+|norm|bump|disp|refl)[ \t]+(.+?)[ \t\r]*$", re.M | re.I)
WHEN = (1980, 1, 1, 0, 0, 0)
"""Date of what is in a zip: the same files make the same zip."""


def gathered(path: Path, data: bytes, looks: bool) -> bytes | None:
    """A zip of a mesh file and of those that it names and that are there; None if there is none.

    What lies outside of the file's own folder is left alone, whatever the file says.

    Args:
        path: of the file.
        data: its bytes.
        looks: also gather what only the looks of an OBJ need.

    Raises:
        OSError: when one can't be read.
    """
    match path.suffix.lower():
        case ".gltf":
            names = _of_gltf(data)
        case ".obj" if looks:
            names = _of_obj(path.parent, data)
        case _:
            return None
    found = {name: path.parent / name for name in names if _within(name)}
    there = {name: file for name, file in found.items() if file.is_file()}
    if not there:
        return None
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(zipfile.ZipInfo(path.name, WHEN), data)
        for name, file in sorted(there.items()):
            archive.writestr(zipfile.ZipInfo(name, WHEN), file.read_bytes())
    return buffer.getvalue()


def members(archive: bytes) -> Iterator[tuple[str, bytes]]:
    """Names and contents of what is in a zip, without what would lie outside of its folder."""
    with zipfile.ZipFile(BytesIO(archive)) as opened:
        for entry in opened.infolist():
            if not entry.is_dir() and _within(entry.filename):
                yield entry.filename, opened.read(entry)


def _of_gltf(data: bytes) -> Iterator[str]:
    try:
        document = json.loads(data)
        entries = [*document.get("buffers", []), *document.get("images", [])]
        uris = [entry.get("uri") for entry in entries]
    except (ValueError, RecursionError, AttributeError, TypeError):
        return  # whoever reads the mesh tells what is wrong with it
    for uri in uris:
        if isinstance(uri, str) and not uri.startswith("data:"):
            yield unquote(uri)


def _of_obj(folder: Path, data: bytes) -> Iterator[str]:
    for library in LIBRARY.findall(data):
        name = _text(library)
        yield name
        if _within(name) and (folder / name).is_file():
            for picture in PICTURE.findall((folder / name).read_bytes()):
                words = _text(picture)
                yield words
                yield words.split()[-1]  # behind options


def _text(name: bytes) -> str:
    return name.decode("utf-8", "replace").replace("\\", "/")


def _within(name: str) -> bool:
    path = PurePosixPath(name)
    plain = not path.is_absolute() and ".." not in path.parts and ":" not in name
    return plain and "\0" not in name and bool(path.name)
