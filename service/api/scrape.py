"""GET /metrics: what Prometheus asks."""

from __future__ import annotations

from anyio import to_thread
from fastapi import APIRouter, Request
from prometheus_client import CONTENT_TYPE_PLAIN_0_0_4, generate_latest
from prometheus_client.core import Metric
from prometheus_client.openmetrics import exposition as openmetrics
from prometheus_client.registry import Collector
from starlette.responses import Response

from service.api.accept import negotiate
from service.api.context import Shared
from service.api.problems import documented

PLAIN = "text/plain"
OPEN = "application/openmetrics-text"

router = APIRouter(tags=["probes"])


@router.get(
    "/metrics",
    summary="How is it doing?",
    description="Metrics for Prometheus, in its text format or as OpenMetrics, whichever `Accept` "
    "prefers. docs/observability.md lists them.",
    response_class=Response,
    responses={
        200: {
            "description": "All metrics of this replica.",
            "content": {
                kind: {"schema": {"type": "string"}, "example": "shape_parameters_workers 2.0\n"}
                for kind in (PLAIN, OPEN)
            },
        },
        **documented(500),
    },
)
async def metrics(request: Request, shared: Shared) -> Response:
    # What is read belongs to the event loop; to write it down takes longer, and can be elsewhere.
    seen = _Seen(list(shared.metrics.registry.collect()))
    accept = ",".join(request.headers.getlist("accept"))
    if negotiate(accept, [PLAIN, OPEN]) == OPEN:
        text = await to_thread.run_sync(openmetrics.generate_latest, seen)
        kind = openmetrics.CONTENT_TYPE_LATEST
    else:
        text = await to_thread.run_sync(generate_latest, seen)
        kind = CONTENT_TYPE_PLAIN_0_0_4
    return Response(text, headers={"Content-Type": kind, "Vary": "Accept"})


class _Seen(Collector):
    """All families at one moment."""

    def __init__(self, families: list[Metric]) -> None:
        self._families = families

    def collect(self) -> list[Metric]:
        return self._families
