"""POST /infer: what the parameters of a mesh are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import JSONResponse, Response

from service import pipeline
from service.api.context import Shared
from service.api.etags import REVALIDATED, named, not_modified, validator, weak
from service.api.forms import InferForm, form_content_type, upload_of
from service.api.keeping import keep
from service.api.problems import documented
from service.api.report_response import report_response
from service.api.schemas import TAG_HEADERS, InferReport
from service.encode.model import Model
from service.inferences import Inferences
from service.requests import Upload
from service.store.meshstore import MeshStore

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
    upload = await upload_of(request, form, shared.store)
    models = await shared.readiness.models()
    run, kept = shared.workers.run, (shared.store, shared.inferences)
    return await run(request, _infer, request, form, upload, models, *kept)


def _infer(
    request: Request,
    form: InferForm,
    upload: Upload,
    models: Mapping[str, Model],
    store: MeshStore,
    known: Inferences,
) -> Response:
    inside = validator(request, upload, form, models)
    if inside in named(request) and not keep(request, store, upload):
        return not_modified(weak(inside), REVALIDATED)
    report = pipeline.infer(upload, models, form.infer_options(), known).report()
    request.state.report = report
    return report_response(request, report, keep(request, store, upload), inside, REVALIDATED)
