"""POST /edit: the same file with its parameters changed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import Response

from service import pipeline
from service.api.accept import negotiate
from service.api.asked import Asked, answered
from service.api.context import Shared
from service.api.etags import REVALIDATED, named, not_modified, weak
from service.api.filenames import edited_name
from service.api.forms import EditForm, form_content_type
from service.api.keeping import EDITED, keep, owner_of
from service.api.mesh_response import mesh_response
from service.api.problems import documented
from service.api.report_response import report_response
from service.api.schemas import MESH_CONTENT, MESH_HEADERS, EditReport
from service.constraints import NONE, parse_constraints
from service.edits import parse_edits
from service.errors import NotFound
from service.requests import Upload

JSON = "application/json"

_HEADERS = {**REVALIDATED, "Vary": "Accept"}

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
    "`GET /meshes/{mesh_id}`.",
    dependencies=[Depends(form_content_type)],
    response_class=Response,
    responses={
        200: {
            "description": "The edited file, or the report of the edit.",
            "model": EditReport,
            "content": MESH_CONTENT,
            "headers": {
                **MESH_HEADERS,
                "Shape-Parameters": {
                    "description": "JSON: the parameters' values after the edit.",
                    "schema": {"type": "string", "contentMediaType": JSON},
                },
            },
        },
        304: {"description": "The client's `If-None-Match` names the edited file."},
        **documented(400, 404, 408, 413, 415, 422, 429, 500, 503),
    },
)
async def edit(
    request: Request,
    form: Annotated[EditForm, Form(media_type="multipart/form-data")],
    shared: Shared,
) -> Response:
    return await answered(request, form, shared, _edit)


def _edit(asked: Asked[EditForm]) -> Response:
    request, form, upload = asked.request, asked.form, asked.upload
    inside = asked.validator()
    if (tag := _held(asked, inside)) is not None:
        return not_modified(tag, _HEADERS)
    edits = parse_edits(form.edits) if form.edits is not None else {}
    constraints = parse_constraints(form.constraints) if form.constraints is not None else NONE
    options = form.infer_options(), edits, form.edit_options()
    edited = pipeline.edit(upload, asked.models, *options, constraints, asked.known)
    request.state.report = edited.report
    result = Upload(edited.data, edited_name(upload.name, edited.format), edited.media_type)
    accept = ",".join(request.headers.getlist("accept"))
    if negotiate(accept, [edited.media_type, JSON]) == JSON:
        warnings = asked.keep() + keep(request, asked.store, result, EDITED)
        ids = {"mesh_id": result.mesh_id, "source_mesh_id": upload.mesh_id}
        inside = _of_report(inside, result.mesh_id)
        return report_response(request, {**ids, **edited.report}, warnings, inside, _HEADERS)
    headers = {**_HEADERS, "Shape-Parameters": _compact(edited.parameters)}
    return mesh_response(request, result, weak(inside), headers)


def _held(asked: Asked[EditForm], inside: str) -> str | None:
    """The tag of an answer that the client holds and that would be the same now.

    A report names the edited mesh, which must still be there.  So its tag holds that mesh's id:
    nothing else knows it before the edit is made again.
    """
    for tag in named(asked.request):
        if tag == inside:
            return weak(tag)
        mesh_id = tag.removeprefix(_of_report(inside, ""))
        if mesh_id != tag:
            try:
                asked.store.get(mesh_id, owner_of(asked.request))
            except NotFound:
                continue
            if not asked.keep():
                return weak(tag)
    return None


def _of_report(inside: str, mesh_id: str) -> str:
    return f"{inside}.{mesh_id}"


def _compact(parameters: Mapping[str, float]) -> str:
    """JSON for a header: six significant digits, no spaces."""
    rounded = {name: float(f"{value:.6g}") for name, value in parameters.items()}
    return json.dumps(rounded, separators=(",", ":"))
