"""POST /infer: what the parameters of a mesh are."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import JSONResponse, Response

from service import pipeline
from service.api.asked import Asked, answered
from service.api.context import Shared
from service.api.etags import REVALIDATED, named, not_modified, weak
from service.api.forms import InferForm, form_content_type
from service.api.problems import documented
from service.api.report_response import report_response
from service.api.schemas import TAG_HEADERS, InferReport

router = APIRouter(tags=["shapes"])


@router.post(
    "/infer",
    summary="Infer a mesh's parameters",
    description="Finds the category, the orientation and the named parameters, each with its "
    "standard deviation, in the file's own unit.\n\n"
    "    curl -F mesh=@chair.glb http://127.0.0.1:8000/infer\n\n"
    "The mesh is kept for a while: later calls may name it by `mesh_id`.",
    dependencies=[Depends(form_content_type)],
    response_class=JSONResponse,
    responses={
        200: {
            "model": InferReport,
            "description": "The parameters and how well they fit.",
            "headers": TAG_HEADERS,
        },
        304: {"description": "The client's `If-None-Match` names the answer."},
        **documented(400, 404, 408, 413, 415, 422, 429, 500, 503),
    },
)
async def infer(
    request: Request,
    form: Annotated[InferForm, Form(media_type="multipart/form-data")],
    shared: Shared,
) -> Response:
    return await answered(request, form, shared, _infer)


def _infer(asked: Asked[InferForm]) -> Response:
    request, inside = asked.request, asked.validator()
    if inside in named(request) and not asked.keep():
        return not_modified(weak(inside), REVALIDATED)
    options = asked.form.infer_options()
    report = pipeline.infer(asked.upload, asked.models, options, asked.known).report()
    request.state.report = report
    return report_response(request, report, asked.keep(), inside, REVALIDATED)
