"""POST /transfer: a mesh with the parameters of another."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import Response

from service import pipeline
from service.api.asked import Asked, answered
from service.api.context import Shared
from service.api.edited_response import edited_response
from service.api.forms import TransferForm, form_content_type
from service.api.problems import documented
from service.api.schemas import EDITED_HEADERS, MESH_CONTENT, TransferReport
from service.edited import Edited

router = APIRouter(tags=["shapes"])


@router.post(
    "/transfer",
    summary="Give a mesh the parameters of another",
    description="Answers the source's file, edited to the parameters of the target: as `POST "
    "/edit` does, with values that come from another mesh. Both are of one category. What has the "
    "target's parameters already comes back as its own bytes.\n\n"
    "    curl -F source=@chair.glb -F target=@other.obj -F target_units=cm \\\n"
    "         http://127.0.0.1:8000/transfer -OJ\n\n"
    "With `size=source` it gets the target's proportions and stays as large as it is; with "
    "`position=target` it is put where the target stands. `category`, `up`, `front` and `units` "
    "are the source's, but that the target is of the same category, and in the same unit unless "
    "`target_units` says another.\n\n"
    "Where one of the two is at fault, the `detail` of the problem begins with `source:` or "
    "`target:`. Shapes of two categories are a 422 with the code `categories_differ`.\n\n"
    "With `Accept: application/json` it answers a report instead, whose `transfer` says what was "
    "taken from the target, and keeps all three meshes for `GET /meshes/{mesh_id}`.",
    dependencies=[Depends(form_content_type)],
    response_class=Response,
    responses={
        200: {
            "description": "The source's file, edited, or the report of that.",
            "model": TransferReport,
            "content": MESH_CONTENT,
            "headers": EDITED_HEADERS,
        },
        304: {"description": "The client's `If-None-Match` names the edited file."},
        **documented(400, 404, 408, 413, 415, 422, 429, 500, 503),
    },
)
async def transfer(
    request: Request,
    form: Annotated[TransferForm, Form(media_type="multipart/form-data")],
    shared: Shared,
) -> Response:
    return await answered(request, form, shared, _transfer)


def _transfer(asked: Asked[TransferForm]) -> Response:
    return edited_response(asked, partial(_transferred, asked))


def _transferred(asked: Asked[TransferForm]) -> Edited:
    form, (source, target) = asked.form, asked.uploads
    options = form.infer_options(), form.target_options(), form.transfer_options()
    return pipeline.transfer(source, target, asked.models, *options, asked.known)
