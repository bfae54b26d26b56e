"""What a client prefers of how it is answered (RFC 7240)."""

from __future__ import annotations

from typing import Annotated

from fastapi import Header
from pydantic import StringConstraints
from pydantic.json_schema import SkipJsonSchema
from starlette.requests import Request

RESPOND_ASYNC = "respond-async"

Prefer = Annotated[
    str | SkipJsonSchema[None],
    Header(
        description="`respond-async`: be answered at once, with 202 and a job to come back to.",
        examples=[RESPOND_ASYNC],
    ),
]
Key = Annotated[str, StringConstraints(min_length=1, max_length=255, pattern="^[!-~]+$")]
IdempotencyKey = Annotated[
    Key | SkipJsonSchema[None],
    Header(
        description="With `Prefer: respond-async`: the same key gives the same job again, however "
        "often the request is sent.",
        examples=["2f9c4be1"],
    ),
]


def prefers_async(request: Request) -> bool:
    """Whether a job is preferred to waiting."""
    preferences = ",".join(request.headers.getlist("prefer")).split(",")
    names = {text.partition(";")[0].partition("=")[0].strip().lower() for text in preferences}
    return RESPOND_ASYNC in names
