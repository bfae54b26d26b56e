"""Zip archives for tests: a mesh with what belongs to it, packed in every way."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping

from gltf_assets import Asset
from mesh_samples import asset, obj

PICTURE = b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 8


def zipped(
    members: Mapping[str, bytes],
    method: int = zipfile.ZIP_DEFLATED,
    comment: bytes = b"",
    streamed: bool = False,
) -> bytes:
    """An archive of `members`; `streamed` as to a pipe, with sizes behind each member."""
    target = io.BytesIO()
    with zipfile.ZipFile(Pipe(target) if streamed else target, "w", method) as archive:
        for number, (name, content) in enumerate(members.items()):
            info = zipfile.ZipInfo(name, (2001 + number, 2, 3, 4, 5, 6))
            info.external_attr = 0o640 << 16
            info.compress_type = method
            info.comment = f"number {number}".encode()
            archive.writestr(info, content)
        archive.comment = comment
    return target.getvalue()


class Pipe(io.RawIOBase):
    """A file that can only be written on."""

    def __init__(self, target: io.BytesIO) -> None:
        self._target = target

    def writable(self) -> bool:
        return True

    def write(self, content: bytes) -> int:  # type: ignore[override]
        return self._target.write(content)


def members(data: bytes) -> dict[str, bytes]:
    """The content of all members, each checked against its sum."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def obj_members() -> dict[str, bytes]:
    """An OBJ in a folder with its material and texture, and a note of macOS."""
    return {
        "chair/": b"",
        "chair/ball.mtl": b"newmtl wood\nmap_Kd wood.png\n",
        "chair/ball.obj": obj(),
        "__MACOSX/chair/._ball.obj": b"\0\5\x16\7",
        "chair/wood.png": PICTURE,
    }


def gltf_members(uri: str = "scene.bin", file: str = "scene.bin") -> dict[str, bytes]:
    """A glTF whose buffer is the member `file`, with some bytes behind its length."""
    built: Asset = asset()
    root = {**built.root, "images": [{"uri": "textures/wood%20dark.png"}]}
    root["buffers"] = [{"uri": uri, **built.root["buffers"][0]}]
    return {
        "license.txt": b"CC0",
        "scene.gltf": json.dumps(root, indent=2).encode(),
        file: bytes(built.chunk) + b"tail",
        "textures/wood dark.png": PICTURE,
    }
