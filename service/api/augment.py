"""POST /augment: variants of a mesh that look like real shapes, with labels, for learning."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import Response

from service.api.context import Shared
from service.api.forms import AugmentForm, form_content_type
from service.api.prefer import IdempotencyKey, Prefer
from service.api.problems import documented
from service.api.schemas import MESH_HEADERS
from service.api.several import ACCEPTED, ARCHIVE, several
from service.jobs.order import Order
from service.requests import Upload

router = APIRouter(tags=["shapes"])


@router.post(
    "/augment",
    summary="Draw variants of a mesh",
    description="Answers a zip: variants of the upload, edited towards draws from real shapes; a "
    "`manifest.jsonl` with a line for each, its parameters, edits, validity and provenance; and "
    "`labels.json`, the part that each vertex belongs to, which is the same for all. Each variant "
    "depends on the file, the seed and its index alone.\n\n"
    "    curl -F mesh=@chair.glb -F count=20 -F seed=1 http://127.0.0.1:8000/augment -OJ\n\n"
    "A variant that no draw leaves whole has its `problem` in the manifest and no file. With "
    "`Prefer: respond-async` a job makes the zip.",
    dependencies=[Depends(form_content_type)],
    response_class=Response,
    responses={
        200: {"description": "The zip.", "content": ARCHIVE, "headers": MESH_HEADERS},
        202: ACCEPTED,
        304: {"description": "The client's `If-None-Match` names this zip."},
        **documented(400, 404, 408, 409, 413, 415, 422, 429, 500, 503),
    },
)
async def augment(
    request: Request,
    form: Annotated[AugmentForm, Form(media_type="multipart/form-data")],
    shared: Shared,
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    return await several(request, form, shared, _order, idempotency_key)


def _order(form: AugmentForm, upload: Upload) -> Order:
    options = form.infer_options(), form.edit_options()
    return Order("augment", upload, *options, draw=form.augment_options())
