"""What the routes share: made once an app, handed to them by dependency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from service.api.admission import Admission
from service.api.metrics import Metrics
from service.api.readiness import Readiness
from service.api.workers import Workers
from service.inferences import Inferences
from service.jobs.jobs import Jobs
from service.store.meshstore import MeshStore


@dataclass(frozen=True)
class Context:
    """The service's state: what is kept, loaded and measured, who works, who is let in, and
    what is worked on beside requests."""

    store: MeshStore
    inferences: Inferences
    readiness: Readiness
    workers: Workers
    admission: Admission
    metrics: Metrics
    jobs: Jobs


def context_of(request: Request) -> Context:
    """The context of the app that the request came to."""
    context: Context = request.app.state.context
    return context


Shared = Annotated[Context, Depends(context_of)]
