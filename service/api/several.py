"""Many variants of one mesh as an HTTP answer: the zip at once, or a job that makes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from anyio import to_thread
from fastapi import Request
from starlette.responses import JSONResponse, Response, StreamingResponse

from service.api.asked import Asked, Form, answered
from service.api.context import Context
from service.api.etags import REVALIDATED, held, not_modified, weak
from service.api.filenames import content_disposition, derived_name
from service.api.forms import uploads_of
from service.api.jobdocument import job_document
from service.api.keeping import owner_of
from service.api.prefer import RESPOND_ASYNC, prefers_async
from service.api.schemas import BINARY, Job
from service.encode.versions import choose
from service.errors import Overloaded, TooComplex, TooLarge
from service.jobs.archive import MEDIA_TYPE, archive, contents
from service.jobs.making import Making, making
from service.jobs.order import Order
from service.requests import Upload

OrderOf = Callable[[Form, Upload], Order]

RETRY_S = 1
"""When to look at a job again, in seconds."""
LATER = "Ask for fewer variants, or send `Prefer: respond-async` and fetch them when they are made."

ACCEPTED: dict[str, Any] = {
    "description": "To `Prefer: respond-async`: a job makes the zip.",
    "model": Job,
    "headers": {
        "Location": {
            "description": "Where the job is told of.",
            "schema": {"type": "string", "format": "uri-reference"},
        },
        "Preference-Applied": {
            "description": "`respond-async`.",
            "schema": {"type": "string"},
        },
        "Retry-After": {
            "description": "Seconds until there may be news of it.",
            "schema": {"type": "integer", "minimum": 1},
        },
    },
}
ARCHIVE: dict[str, Any] = {MEDIA_TYPE: BINARY}

_VARY = {"Vary": "Prefer"}


async def several(
    request: Request, form: Form, shared: Context, order_of: OrderOf[Form], key: str | None
) -> Response:
    """The zip of an order's variants, or the job that makes it.

    Raises:
        ShapeError: as `answered`, `making` and `JobStore.submit`.
    """
    if not prefers_async(request):
        return await answered(request, form, shared, partial(_zip, order_of, shared))
    (upload,) = await uploads_of(request, form, shared.store)
    order = order_of(form, upload)
    order.draw.require_sound()
    choose(await shared.readiness.models(), order.options.category)
    given = order, owner_of(request), request.state.trace_id, key
    job = await to_thread.run_sync(shared.jobs.submit, *given)
    headers = {
        "Location": f"/jobs/{job.id}",
        "Preference-Applied": RESPOND_ASYNC,
        "Retry-After": str(RETRY_S),
        "Cache-Control": "no-store",
        **_VARY,
    }
    return JSONResponse(job_document(job), 202, headers)


def zip_response(name: str | None, pieces: Any, headers: dict[str, str]) -> Response:
    """A zip that is sent as it comes.

    Args:
        name: the upload's.
    """
    own = {"Content-Disposition": content_disposition(derived_name(name, "variants", "zip"))}
    return StreamingResponse(pieces, media_type=MEDIA_TYPE, headers={**headers, **own})


def _zip(order_of: OrderOf[Form], shared: Context, asked: Asked[Form]) -> Response:
    headers = {**REVALIDATED, **_VARY}
    tag = weak(asked.validator())
    if held(asked.request, tag):
        return not_modified(tag, headers)
    order = order_of(asked.form, asked.upload)
    try:
        files = _files(order, asked, shared.admission.most_bytes)
    except (Overloaded, TooComplex) as error:
        raise type(error)(error.code, error.detail, LATER) from error
    return zip_response(asked.upload.name, archive(files), {"ETag": tag, **headers})


def _files(order: Order, asked: Asked[Form], most: int) -> list[tuple[str, bytes]]:
    """All of the archive, of so many bytes at most."""
    with making(order, asked.models, asked.known) as made:
        return list(contents(_parts(order, made, most), made.labels))


def _parts(order: Order, made: Making, most: int) -> Iterator[tuple[str | None, str, bytes | None]]:
    size = 0
    for index in range(order.total):
        part = made.part(index)
        size += len(part.data or b"")
        if size > most:
            raise TooLarge(
                "variants_too_large", f"The variants take more than {most} bytes together.", LATER
            )
        yield part.name, part.line, part.data
