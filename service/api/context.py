"""What the routes share: made once an app, handed to them by dependency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from service.api.readiness import Readiness
from service.api.store import MeshStore
from service.api.workers import Workers


@dataclass(frozen=True)
class Context:
    """The service's state: what is kept, what is loaded, and who works."""

    store: MeshStore
    readiness: Readiness
    workers: Workers


def context_of(request: Request) -> Context:
    """The context of the app that the request came to."""
    context: Context = request.app.state.context
    return context


Shared = Annotated[Context, Depends(context_of)]
