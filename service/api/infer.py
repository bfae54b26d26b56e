"""POST /infer: what the parameters of a mesh are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import JSONResponse

from service import pipeline
from service.api.context import Shared
from service.api.forms import InferForm, form_content_type, upload_of
from service.api.problems import documented
from service.api.schemas import InferReport
from service.api.store import MeshStore
from service.encode.model import Model
from service.requests import InferOptions, Upload

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
        200: {"model": InferReport, "description": "The parameters and how well they fit."},
        **documented(400, 404, 413, 415, 422, 500, 503),
    },
)
async def infer(
    request: Request,
    form: Annotated[InferForm, Form(media_type="multipart/form-data")],
    shared: Shared,
) -> JSONResponse:
    upload = await upload_of(request, form, shared.store)
    models = await shared.readiness.models()
    report = await shared.workers.run(_infer, upload, models, form.infer_options(), shared.store)
    return JSONResponse(report)


def _infer(
    upload: Upload, models: Mapping[str, Model], options: InferOptions, store: MeshStore
) -> dict[str, Any]:
    report = pipeline.infer(upload, models, options).report()
    store.put(upload)
    return report
