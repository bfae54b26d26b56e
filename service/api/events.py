"""GET /jobs/{job_id}/events: a job's course as server-sent events."""

from __future__ import annotations

import json
import time
from collections.abc import AsyncIterator
from typing import Annotated

from anyio import sleep, to_thread
from fastapi import APIRouter, Header, Request
from pydantic.json_schema import SkipJsonSchema
from starlette.responses import Response, StreamingResponse

from service.api.context import Context, Shared
from service.api.jobdocument import job_document
from service.api.jobs import JobId
from service.api.keeping import owner_of
from service.api.problems import documented
from service.errors import Crowded, ShapeError
from service.jobs.job import Job

router = APIRouter(tags=["jobs"])

MEDIA_TYPE = "text/event-stream"
STREAMS = 64
"""Clients that are told of jobs at one time."""
LOOK_S = 0.25
"""Between two looks at a job that this process may have changed."""
FAR_LOOK_S = 1.0
"""The same of a job that only another process can have changed."""
COMMENT_S = 10.0
"""Silence after which a comment is sent, so that nothing between takes the connection for dead."""
RETRY_MS = 2000
"""When a client whose stream broke off is to come again."""

_HEADERS = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}


@router.get(
    "/jobs/{job_id}/events",
    summary="Follow a job",
    description="Server-sent events named `status`, whose `data` is the job and whose `id` its "
    "version: the state of the moment, each change after it, and with the last the stream ends. "
    "A client that was cut off says in `Last-Event-ID` what it has heard.",
    response_class=Response,
    responses={
        200: {
            "description": "The stream.",
            "content": {MEDIA_TYPE: {"schema": {"type": "string"}}},
        },
        204: {"description": "The job is finished, and the client has heard so."},
        **documented(404, 429, 500, 503),
    },
)
async def follow_job(
    request: Request,
    job_id: JobId,
    shared: Shared,
    last_event_id: Annotated[
        str | SkipJsonSchema[None],
        Header(description="The `id` of the last event that came.", examples=["3"]),
    ] = None,
) -> Response:
    job = await to_thread.run_sync(shared.jobs.store.get, job_id, owner_of(request))
    heard = _version(last_event_id)
    if not job.is_open and heard >= job.version:
        return Response(status_code=204, headers=_HEADERS)
    if shared.jobs.streams >= STREAMS:
        raise Crowded(
            "streams_full",
            f"As many as {STREAMS} clients are being told of jobs.",
            "Ask for the job itself, or come again after as many seconds as Retry-After says.",
        )
    if getattr(request.state, "head", False):
        return Response(media_type=MEDIA_TYPE, headers=_HEADERS)
    course = _course(shared, job, owner_of(request), heard)
    return StreamingResponse(course, media_type=MEDIA_TYPE, headers=_HEADERS)


async def _course(shared: Context, job: Job, owner: str, heard: int) -> AsyncIterator[str]:
    jobs, store = shared.jobs, shared.jobs.store
    jobs.streams += 1
    try:
        yield f"retry: {RETRY_MS}\n\n"
        told_at = time.monotonic()
        while True:
            if job.version > heard:
                heard, told_at = job.version, time.monotonic()
                yield _event(job)
            if not job.is_open:
                return
            changes, looked_at = store.changes, time.monotonic()
            while True:
                await sleep(LOOK_S)
                if shared.readiness.draining:
                    return
                now = time.monotonic()
                if now - told_at > COMMENT_S:
                    told_at = now
                    yield ": so far\n\n"
                if store.changes != changes or now - looked_at > FAR_LOOK_S:
                    break
            # It may be removed meanwhile; the client finds out when it comes again.
            try:
                job = await to_thread.run_sync(store.get, job.id, owner)
            except ShapeError:
                return
    finally:
        jobs.streams -= 1


def _event(job: Job) -> str:
    data = json.dumps(job_document(job), separators=(",", ":"))
    return f"event: status\nid: {job.version}\ndata: {data}\n\n"


def _version(last_event_id: str | None) -> int:
    """What the client has heard; 0 for nothing, or what was never an event's."""
    text = last_event_id or ""
    return int(text) if text.isascii() and text.isdigit() and len(text) < 16 else 0
