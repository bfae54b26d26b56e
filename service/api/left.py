"""A client that left before its answer: its request ends with a status that nobody is sent."""

from __future__ import annotations

from fastapi import Request
from starlette.exceptions import HTTPException
from starlette.responses import Response

STATUS = 499
"""For logs and metrics, as proxies have it; no connection is there to carry it."""


class ClientLeft(HTTPException):
    """Raised where a request is read or worked on; an HTTPException, as form parsers let it by."""

    def __init__(self) -> None:
        super().__init__(STATUS, "The client left.")


async def to_nobody(request: Request, error: Exception) -> Response:
    """What handlers and middleware may note of such a request."""
    return Response(status_code=STATUS)
