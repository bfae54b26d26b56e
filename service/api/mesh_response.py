"""A mesh file as an HTTP answer, with an ETag to save sending it twice."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from starlette.requests import Request
from starlette.responses import Response

from service.api.etags import held, not_modified
from service.api.filenames import clean, content_disposition
from service.requests import Upload

OPAQUE = "application/octet-stream"

MEDIA_TYPES: dict[str, str] = {
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
    ".obj": "model/obj",
    ".ply": "application/x-ply",
    ".stl": "model/stl",
    ".off": "model/vnd.off",
    ".zip": "application/zip",
}


def mesh_response(request: Request, mesh: Upload, tag: str, headers: Mapping[str, str]) -> Response:
    """The file as an attachment, or 304 when the client says that it holds it.

    The media type follows the name's suffix: what a client called its upload is never sent back,
    since a browser might run it.

    Args:
        tag: the answer's ETag.
        headers: more headers, of both answers.
    """
    if held(request, tag):
        return not_modified(tag, headers)
    name = clean(mesh.name)
    own = {
        "ETag": tag,
        "Content-Type": MEDIA_TYPES.get(PurePath(name).suffix.lower(), OPAQUE),
        "Content-Disposition": content_disposition(name),
    }
    return Response(mesh.data, headers={**headers, **own})
