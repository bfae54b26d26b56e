"""Any supported file as a `MeshFile`: which format it is, and whether its mesh is usable."""

from __future__ import annotations

import re
from pathlib import PurePath

import numpy as np

from service.errors import ShapeError
from service.mesh.checks import check
from service.mesh.faults import malformed, quoted, unsupported
from service.mesh.glb import GlbFile
from service.mesh.gltf import GltfFile
from service.mesh.meshfile import MeshFile
from service.mesh.obj import ObjFile
from service.mesh.off import OffFile
from service.mesh.ply import PlyFile
from service.mesh.stl import StlFile, is_ascii, is_binary
from service.mesh.zipped import ZippedFile

READERS: dict[str, type[MeshFile]] = {
    "glb": GlbFile,
    "gltf": GltfFile,
    "obj": ObjFile,
    "ply": PlyFile,
    "stl": StlFile,
    "off": OffFile,
}
ZIP = "zip"
MEDIA_TYPES = {
    "model/gltf-binary": "glb",
    "model/gltf+json": "gltf",
    "model/obj": "obj",
    "application/x-ply": "ply",
    "model/ply": "ply",
    "model/stl": "stl",
    "application/sla": "stl",
    "application/vnd.ms-pki.stl": "stl",
    "model/x.stl-ascii": "stl",
    "model/x.stl-binary": "stl",
    "model/vnd.off": "off",
    "model/off": "off",
    "application/zip": ZIP,
    "application/x-zip-compressed": ZIP,
}
OFF_START = re.compile(rb"\s*(ST)?C?N?4?n?OFF\b")
JSON_START = re.compile(rb"(\xef\xbb\xbf)?\s*\{")
OBJ_LINE = re.compile(
    rb"^[ \t]*(mtllib|usemtl|[vV][nt]?[ \t]+[-+.0-9]|f[ \t]+[-0-9])", re.MULTILINE
)
# As far as the first bytes are searched for a line of a known format.
SNIFFED = 1 << 16


def read_mesh(data: bytes, name: str | None = None, content_type: str | None = None) -> MeshFile:
    """Read a mesh file.

    Args:
        data: the file.
        name: its name; the suffix, where it is a known one, tells the format.  A zip is read as
            the one mesh in it.
        content_type: its media type, which tells where the name does not.  The first bytes tell
            where neither does.

    Raises:
        UnsupportedFormat: an unknown format, or a feature that would not survive.
        InvalidMesh: the file is broken, or has no usable surface.
        TooLarge: the file unfolds into too many vertices or faces.
    """
    format = detect(data, name, content_type)
    try:
        # Numbers may overflow on the way; `check` finds what became of them.
        with np.errstate(all="ignore"):
            mesh = ZippedFile(data, READERS) if format == ZIP else READERS[format](data)
            check(mesh)
    except ShapeError:
        raise
    except Exception as error:
        # What damaged bytes can still provoke behind the readers' own checks: never a crash.
        raise malformed(format, quoted(str(error), 80)) from error
    return mesh


def detect(data: bytes, name: str | None, content_type: str | None) -> str:
    """The format's name; UnsupportedFormat ``unsupported_format`` when there is none."""
    suffix = PurePath(name or "").suffix.lower().removeprefix(".")
    if suffix in (*READERS, ZIP):
        return suffix
    media_type = (content_type or "").partition(";")[0].strip().lower()
    if media_type in MEDIA_TYPES:
        return MEDIA_TYPES[media_type]
    found = _sniff(data)
    if found is None:
        raise unsupported(
            "unsupported_format",
            f"The file {quoted(name or '')} of type {quoted(content_type or '')} is of no known "
            "mesh format",
            f"Upload one of {', '.join(READERS)}, or a zip with one of them; Blender and most "
            "other tools export GLB",
        )
    return found


def _sniff(data: bytes) -> str | None:
    head = data[:SNIFFED]
    if head.startswith(b"glTF"):
        return "glb"
    if head.startswith((b"PK\3\4", b"PK\5\6")):
        return ZIP
    if re.match(rb"ply\s", head):
        return "ply"
    if OFF_START.match(head):
        return "off"
    if JSON_START.match(head):
        return "gltf"
    if is_binary(data) or is_ascii(data):
        return "stl"
    return "obj" if b"\0" not in head and OBJ_LINE.search(head) else None
