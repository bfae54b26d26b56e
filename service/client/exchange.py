"""How a call is carried out, free of input and output.

Each function here is a generator that yields steps; a client carries each out, blocking or not, and
sends back what comes of it or throws in httpx's error.  So both clients decide alike.
"""

from __future__ import annotations

import json
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import httpx

from service.client.call import Answer, Call, Part
from service.client.config import Config
from service.client.errors import (
    AnswerMalformed,
    ConnectionFailed,
    MeshUnknown,
    ServiceError,
    TimedOut,
    problem,
)
from service.client.multipart import Field, Multipart
from service.client.retry import Attempts
from service.client.sink import Sink

T = TypeVar("T")

EXCERPT = 200


@dataclass(frozen=True)
class Send:
    """Close the response before, send this, and give back its response, the body not yet read."""

    request: httpx.Request


@dataclass(frozen=True)
class Read:
    """Read all of the body into the sink, and close the response."""

    response: httpx.Response
    sink: Sink


@dataclass(frozen=True)
class Chunk:
    """Give back the next piece of the body, None at its end."""

    response: httpx.Response


@dataclass(frozen=True)
class Sleep:
    """Wait so many seconds."""

    seconds: float


Step = Send | Read | Chunk | Sleep
Steps = Generator[Step, Any, T]


def exchange(call: Call[T], config: Config) -> Steps[T]:
    """Make the call, again where that helps, and read its answer.

    Raises:
        ServiceError: as the tree in `errors` says.
        OSError: when a file can't be read or written.
    """
    attempts = Attempts(call.how.retry or config.retry)
    whole = False
    while True:
        ids = ids_of(call.parts, whole)
        try:
            return (yield from _attempt(call, config, ids))
        except MeshUnknown:
            # The service holds it no more.  Once all is sent whole, another such answer is final.
            dropped = [
                (part.mesh, known)
                for part, known in zip(call.parts, ids, strict=True)
                if known is not None and part.mesh.has_content
            ]
            if not dropped:
                raise
            whole = True
            for mesh, known in dropped:
                mesh.forget(known)
        except ServiceError as fault:
            yield Sleep(attempts.delay(fault))


def ids_of(parts: tuple[Part, ...], whole: bool = False) -> tuple[str | None, ...]:
    """What each mesh is named by; None for one that is sent.

    Decided once an attempt: other calls may share a mesh, and have it learn or lose its id.

    Args:
        whole: whether to send also what could be named.
    """
    return tuple(
        None if not part.by_id or (whole and part.mesh.has_content) else part.mesh.mesh_id
        for part in parts
    )


def _attempt(call: Call[T], config: Config, ids: tuple[str | None, ...]) -> Steps[T]:
    request = request_of(call, config, ids)
    with translated(request):
        response: httpx.Response = yield Send(request)
    if not response.is_success or _is_page(call, response):
        raise (yield from refusal(response, config))
    sink = Sink(call.how.to, call.how.download_progress, _length(response))
    try:
        with translated(request):
            yield Read(response, sink)
    except BaseException:
        sink.abort()
        raise
    sent = tuple(part.mesh for part in call.parts)
    answer = Answer(response.status_code, response.headers, sink.content, call.how.to, sent)
    try:
        return call.read(answer)
    except ValueError as error:
        what = f"the answer can't be read: {str(error).splitlines()[0]}"
        raise malformed(what, response, sink.content or b"") from error


def refusal(response: httpx.Response, config: Config) -> Generator[Step, Any, ServiceError]:
    """The exception that an answer other than a success stands for."""
    sink = Sink()
    with translated(response.request):
        yield Read(response, sink)
    body = sink.content or b""
    retry_after = config.retry.after(response.headers.get("retry-after"))
    try:
        document = json.loads(body)
    except ValueError:
        document = None
    told = problem(document, response.status_code, retry_after)
    if told is not None:
        return told
    if response.is_redirect:
        return malformed("a redirect, which is not followed,", response, b"", retry_after)
    return malformed("an answer that is no problem document", response, body, retry_after)


def request_of(call: Call[Any], config: Config, ids: tuple[str | None, ...] = ()) -> httpx.Request:
    """The request.

    Args:
        call: what is called.
        config: where, by whom, and how.
        ids: of the call's meshes, see `ids_of`.

    Raises:
        OSError: when a file can't be read.
    """
    url = httpx.URL(config.url + call.path)
    headers = {"Host": url.netloc.decode("ascii"), **config.headers(), **call.headers}
    stream = None
    if call.method == "POST":
        stream = _form(call, ids)
        headers["Content-Type"] = stream.content_type
        headers["Content-Length"] = str(stream.length)
    timeout = config.timeout if call.how.timeout is None else httpx.Timeout(call.how.timeout)
    return httpx.Request(
        call.method,
        url,
        headers=headers,
        stream=stream,
        extensions={"timeout": timeout.as_dict()},
    )


def malformed(
    what: str, response: httpx.Response, body: bytes, retry_after: float | None = None
) -> AnswerMalformed:
    """The exception for an answer that is not the service's."""
    excerpt = body[:EXCERPT].decode("utf-8", "replace")
    media_type = response.headers.get("content-type", "")
    return AnswerMalformed(what, response.status_code, media_type, excerpt, retry_after)


@contextmanager
def translated(request: httpx.Request) -> Iterator[None]:
    """Turn httpx's errors into the client's."""
    where = f"{request.method} {request.url.copy_with(userinfo=b'', query=None)}"
    try:
        yield
    except httpx.TimeoutException as error:
        kind = type(error).__name__.removesuffix("Timeout").lower()
        raise TimedOut(f"{where}: no answer in time ({kind})") from error
    except (httpx.UnsupportedProtocol, httpx.LocalProtocolError) as error:
        # Such as a header's line break: it can't be sent at all.
        raise ValueError(f"{where}: {error}") from error
    except httpx.HTTPError as error:
        raise ConnectionFailed(f"{where}: {error or type(error).__name__}") from error


def _form(call: Call[Any], ids: tuple[str | None, ...]) -> Multipart:
    texts: list[Field] = list(call.fields)
    files = []
    for part, known in zip(call.parts, ids, strict=True):
        if part.by_id is not None and known is not None:
            texts.append((part.by_id, known))
        else:
            files.append((part.name, part.mesh))
    return Multipart(texts, files, call.how.progress)


def _is_page(call: Call[Any], response: httpx.Response) -> bool:
    """Whether it is some proxy's, though it says that all is well; it is no file to be written."""
    return "Accept" in call.headers and response.headers.get("content-type", "")[:9] == "text/html"


def _length(response: httpx.Response) -> int | None:
    told = response.headers.get("content-length", "")
    encoded = "content-encoding" in response.headers
    return int(told) if told.isdecimal() and not encoded else None
