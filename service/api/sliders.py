"""POST /sliders and POST /template: a mesh with its editing inside, and what was fitted to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Form, Request
from starlette.responses import Response

from service import pipeline
from service.api.asked import Asked, answered
from service.api.context import Shared
from service.api.etags import REVALIDATED, named, not_modified, weak
from service.api.filenames import derived_name
from service.api.forms import SlidersForm, form_content_type
from service.api.mesh_response import MEDIA_TYPES, mesh_response
from service.api.problems import documented
from service.api.schemas import BINARY, MESH_HEADERS
from service.encode.model import Model
from service.inferences import Inferences
from service.requests import InferOptions, SliderOptions, Upload

GLB = MEDIA_TYPES[".glb"]
Make = Callable[[Upload, Mapping[str, Model], InferOptions, SliderOptions, Inferences], bytes]

router = APIRouter(tags=["shapes"])


def _answers(description: str) -> dict[int | str, dict[str, Any]]:
    return {
        200: {"description": description, "content": {GLB: BINARY}, "headers": MESH_HEADERS},
        304: {"description": "The client's `If-None-Match` names the answer."},
        **documented(400, 404, 408, 413, 415, 422, 429, 500, 503),
    }


@router.post(
    "/sliders",
    summary="Put a mesh's parameters into it, as sliders",
    description="Answers a GLB of the upload that any glTF viewer edits with no further request: "
    "one morph target a parameter for rigid categories, a skeleton and shape morphs for bodies. "
    "Materials, textures and nodes stay; other formats come in metres, with their colours, normals "
    "and texture coordinates, and an OBJ in a zip with its materials and pictures.\n\n"
    "    curl -F mesh=@chair.glb http://127.0.0.1:8000/sliders -OJ\n\n"
    "Each mesh's `extras.targetNames` names its targets, and `extras.targets` says of each which "
    "`parameter` it is, its `label`, `unit`, `value`, `range`, and the `change` that a weight of 1 "
    "makes: the weight for a wanted value is `(wanted - value) / change`. "
    "`asset.extras.shape_parameters` holds the rest of what `POST /infer` answers, the derived "
    "dimensions and the limits. Weights in any combination do what `POST /edit` does. The joints "
    "of a body say in their `extras` which parameters their rotation is.",
    dependencies=[Depends(form_content_type)],
    response_class=Response,
    responses=_answers("The upload as a GLB with sliders."),
)
async def sliders(
    request: Request,
    form: Annotated[SlidersForm, Form(media_type="multipart/form-data")],
    shared: Shared,
) -> Response:
    return await answered(request, form, shared, partial(_made, pipeline.sliders, "sliders"))


@router.post(
    "/template",
    summary="See what was fitted to a mesh",
    description="Answers a GLB of the fitted template, to be drawn over the upload: in its frame "
    "and its unit, metres in a GLB, and with the sliders that `POST /sliders` gives the upload.",
    dependencies=[Depends(form_content_type)],
    response_class=Response,
    responses=_answers("The fitted template as a GLB with sliders."),
)
async def template(
    request: Request,
    form: Annotated[SlidersForm, Form(media_type="multipart/form-data")],
    shared: Shared,
) -> Response:
    return await answered(request, form, shared, partial(_made, pipeline.template, "template"))


def _made(make: Make, suffix: str, asked: Asked[SlidersForm]) -> Response:
    form, inside = asked.form, asked.validator()
    if inside in named(asked.request):
        asked.keep()
        return not_modified(weak(inside), REVALIDATED)
    options = form.infer_options(), form.slider_options()
    data = make(asked.upload, asked.models, *options, asked.known)
    asked.keep()
    result = Upload(data, derived_name(asked.upload.name, suffix, "glb"), GLB)
    return mesh_response(asked.request, result, weak(inside), REVALIDATED)
