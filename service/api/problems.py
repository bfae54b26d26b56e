"""Every error as `application/problem+json` (RFC 9457)."""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse
from starlette.types import Receive, Scope, Send

from service.api.field_errors import explain
from service.api.form_limits import overrun
from service.api.left import ClientLeft, to_nobody
from service.api.routes import methods_of
from service.errors import (
    Conflict,
    Crowded,
    InvalidMesh,
    InvalidRequest,
    ModelFault,
    NotFound,
    Overloaded,
    ShapeError,
    TooComplex,
    TooLarge,
    UnsupportedFormat,
)

MEDIA_TYPE = "application/problem+json"

STATUSES: dict[type[ShapeError], int] = {
    UnsupportedFormat: 415,
    InvalidMesh: 422,
    TooLarge: 413,
    TooComplex: 422,
    InvalidRequest: 422,
    NotFound: 404,
    Conflict: 409,
    Crowded: 429,
    Overloaded: 503,
    ModelFault: 503,
}

# Seconds after which the same request may well pass.
RETRY_AFTER = {
    "starting": "1",
    "deadline_exceeded": "10",
    "job_not_finished": "1",
    "jobs_full": "10",
    "jobs_unavailable": "10",
    "streams_full": "5",
}

# RFC 9110's phrases; older Pythons have others.
_TITLES = {413: "Content Too Large", 422: "Unprocessable Content"}

# The framework's own errors: code and suggestion by status.
_PLAIN: dict[int, tuple[str, str]] = {
    400: ("body_malformed", "Send multipart/form-data, as `curl -F mesh=@chair.glb` does."),
    404: ("not_found", "The calls are listed at /docs and in /openapi.json."),
    405: ("method_not_allowed", "Use a method that the Allow header names; see /docs."),
    408: ("body_too_slow", "Send it again; over a slow network send less, such as a zip."),
    413: ("body_too_large", "Send a smaller file, or ask the operator to raise MAX_UPLOAD_BYTES."),
    429: ("overloaded", "Send the request again after as many seconds as Retry-After says."),
}

_WHAT: dict[int, str] = {
    400: "The body is not well-formed multipart.",
    401: "The service wants an API key, and this is none that it knows.",
    403: "A browser says that a page of another origin sends this, and none is let in.",
    404: "There is no such category, mesh, job or path.",
    408: "The body came too slowly.",
    409: "It does not go with what there is: `code` and `detail` say how.",
    413: "The upload, or what is asked of it, is over a limit.",
    415: "The format can't be read, or can't be carried through without loss.",
    422: "The mesh is broken or too complex, or an option or edit makes no sense; `code` and "
    "`detail` say which.",
    429: "The service is at work on as much as it takes; `Retry-After` says when to come again.",
    500: "The service failed; nothing about the inside is told.",
    503: "The models are still loading, one of them can't be trusted, or the service is too busy.",
}

_HEADERS: dict[int, dict[str, Any]] = {
    401: {
        "WWW-Authenticate": {
            "description": "`Bearer`: how a key is sent.",
            "schema": {"type": "string"},
        }
    },
    429: {
        "Retry-After": {
            "description": "Seconds until there is likely to be room.",
            "schema": {"type": "integer", "minimum": 1},
        }
    },
}


def document(
    status: int,
    code: str,
    detail: str,
    suggestion: str,
    trace_id: str,
    members: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """A problem as JSON; arguments as for `Problem`."""
    return {
        "type": "about:blank",
        "title": _TITLES.get(status, HTTPStatus(status).phrase),
        "status": status,
        "detail": detail,
        "code": code,
        "suggestion": suggestion,
        "trace_id": trace_id,
        **(members or {}),
    }


class Problem(JSONResponse):
    """A problem document; `title` is the status's phrase, as goes with `about:blank`.

    RFC 9457 calls ``members`` beyond its own extensions; `ProblemDocument` lists them.
    """

    media_type = MEDIA_TYPE

    def __init__(
        self,
        status: int,
        code: str,
        detail: str,
        suggestion: str,
        trace_id: str,
        headers: dict[str, str] | None = None,
        members: Mapping[str, Any] | None = None,
    ) -> None:
        told = document(status, code, detail, suggestion, trace_id, members)
        super().__init__(told, status_code=status, headers=headers)
        self.code = code

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with it, and note its code where the request's line in the log finds it."""
        scope.setdefault("state", {})["code"] = self.code
        await super().__call__(scope, receive, send)


def internal_error(trace_id: str) -> Problem:
    """What is told of an error that nothing foresaw."""
    return Problem(
        500,
        "internal_error",
        "The service failed while it worked on this request.",
        "Try again; if it happens again, report it with the trace_id.",
        trace_id,
    )


def status_of(error: type[ShapeError]) -> int:
    """Of the answer that tells of it."""
    return next(STATUSES[kind] for kind in error.__mro__ if kind in STATUSES)


async def _shape_error(request: Request, error: Exception) -> Problem:
    assert isinstance(error, ShapeError)
    status = status_of(type(error))
    headers = {"Retry-After": RETRY_AFTER[error.code]} if error.code in RETRY_AFTER else None
    return Problem(
        status,
        error.code,
        error.detail,
        error.suggestion,
        request.state.trace_id,
        headers,
        error.members,
    )


async def _http_error(request: Request, error: Exception) -> Problem:
    assert isinstance(error, HTTPException)
    return from_http(request.scope, error)


def from_http(scope: Scope, error: HTTPException) -> Problem:
    """The framework's error as an answer; middleware answers with it directly."""
    status = error.status_code
    code, suggestion = _PLAIN[status]
    detail = error.detail
    headers = dict(error.headers or {})
    if status == 400 and (told := overrun(detail)) is not None:
        status, code, suggestion = told
    elif status == 404:
        detail = f"There is nothing at {scope['path'][:200]!r}."
    elif status == 405:
        detail = f"{scope['method']} is not a method of {scope['path'][:200]!r}."
        headers["Allow"] = ", ".join(sorted(methods_of(scope["app"].routes, scope["path"])))
    return Problem(status, code, detail, suggestion, scope["state"]["trace_id"], headers)


async def _validation_error(request: Request, error: Exception) -> Problem:
    assert isinstance(error, RequestValidationError)
    code, detail, suggestion = explain(error.errors())
    return Problem(422, code, detail, suggestion, request.state.trace_id)


def install(app: FastAPI) -> None:
    """Answer all errors that a handler can see with problems; `Failures` answers the rest."""
    app.add_exception_handler(ShapeError, _shape_error)
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(ClientLeft, to_nobody)
    app.add_exception_handler(RequestValidationError, _validation_error)


def documented(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """OpenAPI entries for the problems that a route can answer with."""
    schema = {"$ref": "#/components/schemas/ProblemDocument"}
    entries: dict[int | str, dict[str, Any]] = {
        status: {"description": _WHAT[status], "content": {MEDIA_TYPE: {"schema": schema}}}
        for status in statuses
    }
    for status, headers in _HEADERS.items():
        if status in entries:
            entries[status]["headers"] = headers
    return entries
