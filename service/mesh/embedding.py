"""Any mesh as one GLB: what came beside a glTF is put into it, other formats with their looks."""

from __future__ import annotations

import base64
import binascii
import copy
import logging
import mimetypes
from typing import Any

import numpy as np

from service.errors import ShapeError
from service.mesh.buffers import ALIGNMENT
from service.mesh.convert import convert
from service.mesh.document import Object
from service.mesh.folder import Folder
from service.mesh.glb import GlbFile, glb
from service.mesh.gltf import GltfFile
from service.mesh.looks import Looks
from service.mesh.meshcopies import objects
from service.mesh.meshfile import MeshFile
from service.mesh.obj import ObjFile
from service.mesh.objlooks import obj_looks
from service.mesh.off import OffFile
from service.mesh.ply import PlyFile
from service.mesh.pointlooks import off_looks, ply_looks
from service.mesh.polygons import Indices
from service.mesh.wrapping import wrap
from service.mesh.zipped import ZippedFile

LOGGER = logging.getLogger(__name__)


def as_glb(mesh: MeshFile, metres: float) -> tuple[GlbFile, Indices]:
    """The mesh as a GLB that needs no other file, and which of its vertices each of the GLB's is.

    Args:
        mesh: of any format.
        metres: per unit of the file, which a GLB is measured in; of glTF, 1.

    Returns:
        The GLB, and ``[W]`` indices: all in order, but for an OBJ with a vertex that looks
        different in different faces.  Looks that are broken or missing are left out.
    """
    inner = mesh.inner if isinstance(mesh, ZippedFile) else mesh
    same = np.arange(len(inner.vertices))
    if isinstance(inner, GlbFile) and _is_whole(inner):
        return inner, same
    if isinstance(inner, GltfFile):
        return GlbFile(_embedded(inner)), same
    vertices = inner.vertices * metres
    folder = mesh.folder if isinstance(mesh, ZippedFile) else None
    try:
        with np.errstate(all="ignore"):
            looks = _looks(inner, folder)
            if looks is not None:
                return GlbFile(wrap(vertices, looks, folder)), looks.of
    except ShapeError:
        raise
    except Exception:
        # What damaged bytes can still provoke behind the checks: a shape needs no looks.
        LOGGER.exception("a mesh's looks were left out")
    return GlbFile(convert(vertices, inner.faces, "glb")), same


def _looks(mesh: MeshFile, folder: Folder | None) -> Looks | None:
    match mesh:
        case ObjFile():
            return obj_looks(mesh, folder)
        case PlyFile():
            return ply_looks(mesh, folder)
        case OffFile():
            return off_looks(mesh)
    return None


def _is_whole(file: GlbFile) -> bool:
    """Whether the first buffer is the binary chunk, and nothing is in another file."""
    root = file.document.root
    linked = [*objects(file.document, root, "buffers"), *objects(file.document, root, "images")]
    uris = [str(entry["uri"]) for entry in linked if "uri" in entry]
    return file.buffers.in_chunk(0) and all(uri.startswith("data:") for uri in uris)


def _embedded(file: GltfFile) -> bytes:
    """A GLB of an asset whose buffers and images are all in its binary chunk."""
    root: Object = copy.deepcopy(file.document.root)
    chunk = bytearray()

    def append(content: bytes | memoryview) -> int:
        chunk.extend(bytes(-len(chunk) % ALIGNMENT))
        chunk.extend(content)
        return len(chunk) - len(content)

    starts = [append(file.buffers[index]) for index in range(len(root.get("buffers", [])))]
    views: list[Any] = root.setdefault("bufferViews", [])
    for view in objects(file.document, root, "bufferViews"):
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
        view["buffer"] = 0
    for image in objects(file.document, root, "images"):
        if (found := _image(file, image)) is not None:
            content, image["mimeType"] = found
            del image["uri"]
            image["bufferView"] = len(views)
            start = append(content)
            views.append({"buffer": 0, "byteOffset": start, "byteLength": len(content)})
    root["buffers"] = [{"byteLength": len(chunk)}]
    return glb(root, chunk)


def _image(file: GltfFile, image: Object) -> tuple[bytes, str] | None:
    """An image's bytes and media type; None where it stays as it is: embedded, or out of reach."""
    uri = image.get("uri")
    if not isinstance(uri, str):
        return None
    if uri.startswith("data:"):
        head, _, payload = uri.partition(",")
        try:
            return base64.b64decode(payload, validate=True), head[5:].partition(";")[0]
        except (binascii.Error, ValueError):
            return None
    kind = image.get("mimeType") or mimetypes.guess_type(uri)[0]
    try:
        content = file.beside(uri)
    except ShapeError:
        return None
    return None if content is None or not kind else (content, str(kind))
