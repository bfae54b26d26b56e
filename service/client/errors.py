"""What can go wrong, as exceptions.

    ServiceError
    |- ConnectionFailed         no connection, or it broke
    |- TimedOut                 no answer in time; a job that is not finished in time
    |- AnswerMalformed          an answer that is not the service's, such as a proxy's page
    `- ProblemError             the service says no: `code`, `detail`, `suggestion`
       |- BadRequest            400
       |- Unauthorized          401
       |- Forbidden             403
       |- NotFound              404
       |  |- MeshUnknown           the mesh_id is not kept, and there is no content to send again
       |  |- CategoryUnknown       no category has this name
       |  `- JobUnknown            the job is expired or was never there
       |- MethodNotAllowed      405
       |- NotAcceptable         406
       |- RequestTimeout        408
       |- Conflict              409
       |  |- JobNotFinished
       |  |- JobFailed
       |  |- JobCancelled
       |  `- IdempotencyConflict   the key came with another request before
       |- TooLarge              413
       |- UnsupportedMedia      415
       |- Unprocessable         422
       |  |- NotRecognised         the mesh is of no category that is known
       |  |- ParameterUnknown
       |  |- ConstraintsConflict   `conflicts` says which, and what comes nearest
       |  `- CategoriesDiffer      of a transfer's two meshes
       |- TooManyRequests       429
       `- ServerFault           500 and others
          `- Unavailable           503

A code that has no class of its own comes as the class of its status.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import ValidationError

from service.client import models

STANDARD = frozenset({"type", "title", "status", "detail", "code", "suggestion", "trace_id"})


class ServiceError(Exception):
    """Base of every error of the client but those of wrong arguments (TypeError, ValueError)."""


class ConnectionFailed(ServiceError):
    """There is no connection to the service, or it broke before the answer was whole."""


class TimedOut(ServiceError):
    """The service did not answer in time, or a job did not finish in time."""


class AnswerMalformed(ServiceError):
    """The answer is not one that the service gives: a proxy's page, a redirect, a broken document.

    Attributes:
        status: of the answer.
        media_type: what it says that it is.
        excerpt: its beginning.
        retry_after: seconds after which to ask again, if it says so.
    """

    def __init__(
        self,
        what: str,
        status: int,
        media_type: str = "",
        excerpt: str = "",
        retry_after: float | None = None,
    ) -> None:
        said = f" ({media_type or 'no media type'}): {excerpt!r}" if excerpt else ""
        super().__init__(f"{what} with status {status}{said}")
        self.status = status
        self.media_type = media_type
        self.excerpt = excerpt
        self.retry_after = retry_after


class ProblemError(ServiceError):
    """The service refused, and says why.

    Attributes:
        status: HTTP's.
        code: stable, for programs.
        title: the status's phrase.
        detail: what was found.
        suggestion: what to do about it.
        trace_id: finds the request in the service's log.
        members: what the document holds beyond these.
        conflicts: of `ConstraintsConflict`; else empty.
        retry_after: seconds after which the service wants to be asked again, if it says so.
    """

    by_status: ClassVar[dict[int, type[ProblemError]]] = {}
    by_code: ClassVar[dict[str, type[ProblemError]]] = {}

    def __init_subclass__(cls, status: int | None = None, code: str | None = None) -> None:
        if status is not None:
            ProblemError.by_status[status] = cls
        if code is not None:
            ProblemError.by_code[code] = cls

    def __init__(self, document: Mapping[str, Any], retry_after: float | None = None) -> None:
        told = models.ProblemDocument.model_validate(document)
        self.status = told.status
        self.code = told.code
        self.title = told.title
        self.detail = told.detail
        self.suggestion = told.suggestion
        self.trace_id = told.trace_id
        self.conflicts: list[models.Conflict] = told.conflicts or []
        self.members = {name: document[name] for name in document if name not in STANDARD}
        self.retry_after = retry_after
        super().__init__(document, retry_after)

    def __str__(self) -> str:
        said = f"{self.code}: {self.detail}"
        if self.suggestion:
            said += f" ({self.suggestion})"
        return f"{said} [{self.trace_id}]" if self.trace_id else said


class BadRequest(ProblemError, status=400):
    """The request is malformed."""


class Unauthorized(ProblemError, status=401):
    """The service wants an API key, and there is none or another."""


class Forbidden(ProblemError, status=403):
    """The call is not let through."""


class NotFound(ProblemError, status=404):
    """There is no such thing."""


class MeshUnknown(NotFound, code="mesh_id_unknown"):
    """No mesh is kept under the id."""


class CategoryUnknown(NotFound, code="unknown_category"):
    """No category has this name."""


class JobUnknown(NotFound, code="job_unknown"):
    """The job is expired, another's, or was never there."""


class MethodNotAllowed(ProblemError, status=405):
    """The path has no such method."""


class NotAcceptable(ProblemError, status=406):
    """The answer can't be had in such a form."""


class RequestTimeout(ProblemError, status=408):
    """The body came too slowly."""


class Conflict(ProblemError, status=409):
    """What is asked for does not go with the state that things are in."""


class JobNotFinished(Conflict, code="job_not_finished"):
    """The job has no result yet."""


class JobFailed(Conflict, code="job_failed"):
    """The job has no result: it failed."""


class JobCancelled(Conflict, code="job_cancelled"):
    """The job has no result: it was cancelled."""


class IdempotencyConflict(Conflict, code="idempotency_conflict"):
    """The idempotency key came with another request before."""


class TooLarge(ProblemError, status=413):
    """The upload is over a limit."""


class UnsupportedMedia(ProblemError, status=415):
    """The format can't be read, or not carried through without loss."""


class Unprocessable(ProblemError, status=422):
    """The mesh is broken or too complex, or an option or edit makes no sense."""


class NotRecognised(Unprocessable, code="not_recognised"):
    """The mesh is of no category that is known."""


class ParameterUnknown(Unprocessable, code="unknown_parameter"):
    """The category has no parameter of this name."""


class ConstraintsConflict(Unprocessable, code="constraints_conflict"):
    """Constraints contradict each other; `conflicts` says which, and what comes nearest."""


class CategoriesDiffer(Unprocessable, code="categories_differ"):
    """The two meshes of a transfer are of different categories."""


class TooManyRequests(ProblemError, status=429):
    """The service is at work on as much as it takes."""


class ServerFault(ProblemError, status=500):
    """The service failed."""


class Unavailable(ServerFault, status=503):
    """The models are still loading, one can't be trusted, or the service is too busy."""


def problem(document: Any, status: int, retry_after: float | None = None) -> ProblemError | None:
    """The exception for a problem document; None where it is none.

    Args:
        document: what the body holds.
        status: of the answer; a class goes by it where the code has none of its own.
        retry_after: seconds, of the header.
    """
    if not isinstance(document, dict) or not isinstance(code := document.get("code"), str):
        return None
    fallback = ServerFault if status >= 500 else ProblemError
    kind = ProblemError.by_code.get(code) or ProblemError.by_status.get(status, fallback)
    try:
        return kind({**document, "status": status}, retry_after)
    except ValidationError:
        return None
