"""POST /edit: the same file with its parameters changed, once or in many ways."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import Response

from service import pipeline
from service.api.asked import Asked, answered
from service.api.context import Shared
from service.api.edited_response import edited_response
from service.api.forms import EditForm, form_content_type
from service.api.prefer import IdempotencyKey, Prefer
from service.api.problems import documented
from service.api.schemas import EDITED_HEADERS, MESH_CONTENT, EditReport
from service.api.several import ACCEPTED, several
from service.constraints import NONE, parse_constraints
from service.edited import Edited
from service.edits import parse_edits
from service.errors import InvalidRequest
from service.jobs.order import Order
from service.requests import Upload
from service.variantedits import parse_variants

router = APIRouter(tags=["shapes"])


@router.post(
    "/edit",
    summary="Change a mesh's parameters",
    description="Answers the uploaded file with its vertices moved: the same vertices in the same "
    "order, faces, texture coordinates, materials, nodes and names. An empty edit answers the "
    "file's own bytes.\n\n"
    '    curl -F mesh=@chair.glb -F \'edits={"seat_width": {"scale": 1.2}}\' \\\n'
    "         http://127.0.0.1:8000/edit -OJ\n\n"
    "With `constraints` the parameters change by as little as keeps to them, beside the edits or "
    "without any:\n\n"
    "    curl -F mesh=@chair.glb -F \\\n"
    '         \'constraints={"seat_top_height": 0.45, "total_width": {"max": 0.6}}\' \\\n'
    "         http://127.0.0.1:8000/edit -OJ\n\n"
    "Where they contradict each other the answer is a 422 with the code `constraints_conflict`, "
    "whose member `conflicts` names what comes nearest.\n\n"
    "With `Accept: application/json` it answers a report instead, and keeps the edited mesh for "
    "`GET /meshes/{mesh_id}`.\n\n"
    "With `variants` it answers a zip: an edited file for each, and a `manifest.jsonl` with a line "
    "for each, which has a `problem` in place of a file for one that could not be made; with "
    "`Prefer: respond-async` as well, a job makes the zip.",
    dependencies=[Depends(form_content_type)],
    response_class=Response,
    responses={
        200: {
            "description": "The edited file, the report of the edit, or the zip of all variants.",
            "model": EditReport,
            "content": MESH_CONTENT,
            "headers": EDITED_HEADERS,
        },
        202: ACCEPTED,
        304: {"description": "The client's `If-None-Match` names the edited file."},
        **documented(400, 404, 408, 409, 413, 415, 422, 429, 500, 503),
    },
)
async def edit(
    request: Request,
    form: Annotated[EditForm, Form(media_type="multipart/form-data")],
    shared: Shared,
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    if form.variants is not None:
        return await several(request, form, shared, _order, idempotency_key)
    return await answered(request, form, shared, _edit)


def _order(form: EditForm, upload: Upload) -> Order:
    if form.edits is not None or form.constraints is not None:
        raise InvalidRequest(
            "variants_exclusive",
            "The form holds variants beside edits or constraints.",
            "Send `variants` alone; each of them may name all that the edits would.",
        )
    edits = parse_variants(form.variants or "")
    return Order("edit", upload, form.infer_options(), form.edit_options(), edits)


def _edit(asked: Asked[EditForm]) -> Response:
    return edited_response(asked, partial(_edited, asked))


def _edited(asked: Asked[EditForm]) -> Edited:
    form = asked.form
    edits = parse_edits(form.edits) if form.edits is not None else {}
    constraints = parse_constraints(form.constraints) if form.constraints is not None else NONE
    options = form.infer_options(), edits, form.edit_options()
    return pipeline.edit(asked.upload, asked.models, *options, constraints, asked.known)
