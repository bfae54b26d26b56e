"""A mesh file as an HTTP answer, with an ETag to save sending it twice."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from starlette.requests import Request
from starlette.responses import Response

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


def mesh_response(
    request: Request, mesh: Upload, mesh_id: str, headers: Mapping[str, str]
) -> Response:
    """The file as an attachment, or 304 when the client says that it holds it.

    The media type follows the name's suffix: what a client called its upload is never sent back,
    since a browser might run it.

    Args:
        mesh_id: the content's digest; quoted, it is the strong ETag.
        headers: more headers, of both answers.
    """
    common = {"ETag": f'"{mesh_id}"', "X-Content-Type-Options": "nosniff", **headers}
    if _holds(",".join(request.headers.getlist("if-none-match")), mesh_id):
        return Response(status_code=304, headers=common)
    name = clean(mesh.name)
    own = {
        "Content-Type": MEDIA_TYPES.get(PurePath(name).suffix.lower(), OPAQUE),
        "Content-Disposition": content_disposition(name),
    }
    return Response(mesh.data, headers={**common, **own})


def _holds(if_none_match: str, mesh_id: str) -> bool:
    """Whether the header names the content, weakly compared (RFC 9110, section 13.1.2)."""
    tags = {tag.strip().removeprefix("W/") for tag in if_none_match.split(",")}
    return "*" in tags or f'"{mesh_id}"' in tags
