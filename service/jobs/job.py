"""A job: what is told of it, and in which states it may be."""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from service.errors import ShapeError

Status = Literal["queued", "running", "succeeded", "failed", "cancelled"]
STATUSES: tuple[Status, ...] = ("queued", "running", "succeeded", "failed", "cancelled")
OPEN: tuple[Status, ...] = ("queued", "running")
_ERRORS = ShapeError.__module__


@dataclass(frozen=True)
class Job:
    """What is known of a job, but for its mesh and its variants.

    Attributes:
        id: ``job-`` and 22 characters that nobody guesses.
        owner: whose it is.
        version: how often it has changed.
        done, total: of its variants.
        created, started, finished, expires: in seconds since the epoch.
        problem: what is told of its failure: `Failure` as JSON.
        durable: whether it outlives the process.
        order: what is asked, as text; see `Order`.
        name, content_type: of the upload.
        makers: what its variants so far are made by; see `Order.makers`.
        attempts: how often it was taken up since its last variant.
        trace_id: of the request that asked for it.
    """

    id: str
    owner: str
    kind: str
    status: Status
    version: int
    done: int
    total: int
    created: float
    started: float | None
    finished: float | None
    expires: float
    problem: str | None
    durable: bool
    order: str
    digest: str
    name: str | None
    content_type: str | None
    makers: str | None
    attempts: int
    trace_id: str

    @property
    def is_open(self) -> bool:
        """Whether it will still change."""
        return self.status in OPEN

    def told(self) -> dict[str, Any]:
        """The same as JSON for its owner, but for the problem."""
        path = f"/jobs/{self.id}"
        return {
            "id": self.id,
            "kind": self.kind,
            "status": self.status,
            "progress": {"done": self.done, "total": self.total},
            "created": _moment(self.created),
            "started": _moment(self.started),
            "finished": _moment(self.finished),
            "expires": _moment(self.expires),
            "durable": self.durable,
            "problem": None,
            "links": {"self": path, "events": f"{path}/events", "result": f"{path}/result"},
        }


@dataclass(frozen=True)
class Failure:
    """Why a job can't be carried out: a `ShapeError` by the name of its class."""

    kind: str
    code: str
    detail: str
    suggestion: str
    members: dict[str, Any]

    @classmethod
    def of(cls, error: Exception) -> Failure:
        """What is told of an error; of what nothing foresaw, nothing about the inside."""
        if isinstance(error, ShapeError):
            kind = next(kind for kind in type(error).__mro__ if kind.__module__ == _ERRORS)
            own = error.code, error.detail, error.suggestion, dict(error.members)
            return cls(kind.__name__, *own)
        return cls(
            "Exception",
            "internal_error",
            "The service failed while it worked on this job.",
            "Try again; if it happens again, report it with the trace_id.",
            {},
        )

    def told(self) -> dict[str, Any]:
        """What a row of the manifest says of it."""
        own = {"code": self.code, "detail": self.detail, "suggestion": self.suggestion}
        return {**own, **self.members}

    def text(self) -> str:
        """The same as JSON."""
        return json.dumps(vars(self))

    @classmethod
    def read(cls, text: str) -> Failure:
        """The failure of a text."""
        return cls(**json.loads(text))


def new_id() -> str:
    """A fresh id."""
    return f"job-{secrets.token_urlsafe(16)}"


def _moment(seconds: float | None) -> str | None:
    """RFC 3339, in UTC."""
    if seconds is None:
        return None
    told = datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")
    return told.replace("+00:00", "Z")
