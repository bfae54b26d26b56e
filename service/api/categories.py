"""GET /categories: what can be uploaded, and which parameters it has."""

from __future__ import annotations

import hashlib
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response

from service.api.context import Shared
from service.api.etags import held, not_modified, strong
from service.api.problems import documented
from service.api.schemas import TAG_HEADERS, Categories, Category
from service.encode.versions import explain_unknown
from service.errors import NotFound

# What is installed may change at any time.
_CACHING = {"Cache-Control": "no-cache"}
_NOT_MODIFIED = {"description": "The client's `If-None-Match` names the answer."}

router = APIRouter(tags=["categories"])


@router.get(
    "/categories",
    summary="List the categories",
    description="Every installed category with its parameters and its model. Where there are "
    "several versions of the model it is the default one, which `category=chair` and `auto` use; "
    "`versions` lists all of them by the names that a client may send instead, such as "
    "`chair@1.0.0`.",
    response_class=JSONResponse,
    responses={
        200: {
            "model": Categories,
            "description": "The categories, by name.",
            "headers": TAG_HEADERS,
        },
        304: _NOT_MODIFIED,
        **documented(500, 503),
    },
)
async def list_categories(request: Request, shared: Shared) -> Response:
    installed = await shared.readiness.ready()
    names = sorted(installed.models)
    return _answer(request, {"categories": [installed.describe(name) for name in names]})


@router.get(
    "/categories/{name}",
    summary="Describe a category",
    description="Its parameters and derived dimensions: what a slider needs to know of each. "
    "`chair@1.0.0` is the chair as that version of its model knows it.",
    response_class=JSONResponse,
    responses={
        200: {"model": Category, "description": "The category.", "headers": TAG_HEADERS},
        304: _NOT_MODIFIED,
        **documented(404, 500, 503),
    },
)
async def get_category(request: Request, name: str, shared: Shared) -> Response:
    installed = await shared.readiness.ready()
    if name not in installed.named:
        detail, names = explain_unknown(installed.named, name)
        raise NotFound("unknown_category", detail, f"There are {names}.")
    return _answer(request, installed.describe(name))


def _answer(request: Request, document: dict[str, Any]) -> Response:
    """The document, or 304 when the client holds it."""
    answer = JSONResponse(document, headers=_CACHING)
    tag = strong(hashlib.sha256(answer.body).hexdigest()[:32])
    if held(request, tag):
        return not_modified(tag, _CACHING)
    answer.headers["ETag"] = tag
    return answer
