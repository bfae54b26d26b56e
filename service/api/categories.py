"""GET /categories: what can be uploaded, and which parameters it has."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.responses import JSONResponse

from service.api.context import Shared
from service.api.problems import documented
from service.api.schemas import Categories, Category
from service.errors import NotFound

router = APIRouter(tags=["categories"])


@router.get(
    "/categories",
    summary="List the categories",
    description="Every installed category with its parameters and its model.",
    response_class=JSONResponse,
    responses={
        200: {"model": Categories, "description": "The categories, by name."},
        **documented(500, 503),
    },
)
async def list_categories(shared: Shared) -> JSONResponse:
    models = await shared.readiness.models()
    return JSONResponse({"categories": [models[name].describe() for name in sorted(models)]})


@router.get(
    "/categories/{name}",
    summary="Describe a category",
    description="Its parameters and derived dimensions: what a slider needs to know of each.",
    response_class=JSONResponse,
    responses={
        200: {"model": Category, "description": "The category."},
        **documented(404, 500, 503),
    },
)
async def get_category(name: str, shared: Shared) -> JSONResponse:
    models = await shared.readiness.models()
    if name not in models:
        raise NotFound(
            "unknown_category",
            f"There is no category {name[:80]!r}.",
            f"The categories are {', '.join(sorted(models))}.",
        )
    return JSONResponse(models[name].describe())
