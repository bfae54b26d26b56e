"""One call, described: what is sent, and how the answer is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

import httpx
from pydantic import BaseModel

from service.client.files import File
from service.client.mesh import Mesh
from service.client.multipart import Field, Progress
from service.client.retry import Retry

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)
F = TypeVar("F", bound=File)

JSON = "application/json"


@dataclass(frozen=True)
class Answer:
    """A whole answer.

    Attributes:
        status: HTTP's; 2xx.
        headers: its.
        content: its body; None where that was written to `path`.
        path: where it was written.
        sent: the call's meshes.
    """

    status: int
    headers: httpx.Headers
    content: bytes | None = field(repr=False)
    path: Path | None
    sent: tuple[Mesh, ...]


@dataclass(frozen=True)
class Part:
    """A mesh of a form.

    Attributes:
        name: the part that holds its content.
        mesh: what it is.
        by_id: the field that names it instead; None where it is always sent whole.
    """

    name: str
    mesh: Mesh
    by_id: str | None = None


@dataclass(frozen=True)
class Sending:
    """How a call is made, whatever it asks.

    Attributes:
        timeout: seconds or `httpx.Timeout`; None for the client's.
        progress: is told of the upload.
        download_progress: is told of the download.
        to: the file to write the answer to, None for memory.
        retry: None for the client's.
    """

    timeout: float | httpx.Timeout | None = None
    progress: Progress | None = None
    download_progress: Progress | None = None
    to: Path | None = None
    retry: Retry | None = None


@dataclass(frozen=True)
class Call(Generic[T]):
    """What is sent, and how the answer is read.

    Attributes:
        method, path: the path begins with a slash.
        read: the answer as what is wanted; its ValueError becomes `AnswerMalformed`.
        fields: of the form, in order; names may repeat.
        parts: meshes of the form.
        headers: beside those of every request.
        how: see `Sending`.
    """

    method: str
    path: str
    read: Callable[[Answer], T]
    fields: tuple[Field, ...] = ()
    parts: tuple[Part, ...] = ()
    headers: Mapping[str, str] = field(default_factory=dict)
    how: Sending = Sending()


def as_model(kind: type[M]) -> Callable[[Answer], M]:
    """A reader of JSON answers."""

    def read(answer: Answer) -> M:
        return kind.model_validate_json(answer.content or b"")

    return read


def as_file(kind: type[F]) -> Callable[[Answer], F]:
    """A reader of answered files."""

    def read(answer: Answer) -> F:
        return kind.of(answer.headers, answer.content, answer.path)

    return read


def as_is(answer: Answer) -> Answer:
    """Reads nothing."""
    return answer
