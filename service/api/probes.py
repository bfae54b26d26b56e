"""GET /livez and /readyz: what an orchestrator asks."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.responses import JSONResponse

from service.api.context import Shared
from service.api.problems import documented
from service.api.schemas import Alive, Ready
from service.errors import Overloaded

router = APIRouter(tags=["probes"])


@router.get(
    "/livez",
    summary="Is the process alive?",
    description="Always 200, at once, however busy the workers are.",
    response_class=JSONResponse,
    responses={200: {"model": Alive, "description": "It is."}},
)
async def livez() -> JSONResponse:
    return JSONResponse({"status": "alive"})


@router.get(
    "/readyz",
    summary="Can it take requests?",
    description="503 until every model is loaded and has answered its golden request: with the "
    "code `starting`, or `model_fault` when that will not happen by itself; and with `draining` "
    "while it is being stopped. Models of the operator's own that can't be served are listed as "
    "`faults`; the others are served.",
    response_class=JSONResponse,
    responses={
        200: {"model": Ready, "description": "It can, with these models."},
        **documented(503),
    },
)
async def readyz(shared: Shared) -> JSONResponse:
    if shared.readiness.draining:
        raise Overloaded(
            "draining", "The service is about to stop.", "Send requests to another instance."
        )
    installed = shared.readiness.installed
    models = {name: installed.named[name] for name in installed.names}
    names = {
        name: {"name": model.name, "version": model.version, "digest": model.digest}
        for name, model in models.items()
    }
    faults = [
        {"code": fault.code, "detail": fault.detail, "suggestion": fault.suggestion}
        for fault in installed.faults
    ]
    return JSONResponse({"status": "ready", "models": names, "faults": faults})
