"""GET /meshes/{mesh_id}: a mesh that is kept."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Request
from starlette.responses import Response

from service.api.context import Shared
from service.api.etags import strong
from service.api.keeping import owner_of
from service.api.mesh_response import OPAQUE, mesh_response
from service.api.problems import documented
from service.api.schemas import BINARY, MESH_CONTENT, MESH_HEADERS

router = APIRouter(tags=["meshes"])

# An id is its content's digest, so what it names never changes; the meshes are the client's own.
CACHING = {"Cache-Control": "private, max-age=31536000, immutable"}


@router.get(
    "/meshes/{mesh_id}",
    summary="Fetch a kept mesh",
    description="The file that an earlier answer named by `mesh_id`, byte for byte. The cache is "
    "bounded: a mesh that is gone is a 404 with the code `mesh_id_unknown`.",
    response_class=Response,
    responses={
        200: {
            "description": "The file; of no type in particular where it came without a suffix.",
            "content": {**MESH_CONTENT, OPAQUE: BINARY},
            "headers": MESH_HEADERS,
        },
        304: {"description": "The client's `If-None-Match` names this mesh."},
        **documented(404, 500),
    },
)
async def get_mesh(
    request: Request,
    mesh_id: Annotated[str, Path(examples=["sha256-0f4b..."])],
    shared: Shared,
) -> Response:
    mesh = await shared.store.fetch(mesh_id, owner_of(request))
    return mesh_response(request, mesh, strong(mesh_id), CACHING)
