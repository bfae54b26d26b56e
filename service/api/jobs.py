"""/jobs: work that goes on after its request was answered."""

from __future__ import annotations

from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Path, Request
from starlette.responses import JSONResponse, Response

from service.api.context import Shared
from service.api.jobdocument import job_document
from service.api.keeping import owner_of
from service.api.problems import documented
from service.api.schemas import BINARY, MESH_HEADERS, Job, Jobs
from service.api.several import RETRY_S, zip_response
from service.errors import Conflict
from service.jobs.archive import MEDIA_TYPE

router = APIRouter(tags=["jobs"])

JobId = Annotated[str, Path(examples=["job-x8Zb..."])]

NEVER_KEPT = {"Cache-Control": "no-store"}
_RETRY = {
    "Retry-After": {
        "description": "Seconds until there may be news, while it is not finished.",
        "schema": {"type": "integer", "minimum": 1},
    }
}


@router.get(
    "/jobs",
    summary="List your jobs",
    description="Those that the caller's key may see, newest first.",
    response_class=JSONResponse,
    responses={200: {"description": "All of them.", "model": Jobs}, **documented(500, 503)},
)
async def list_jobs(request: Request, shared: Shared) -> Response:
    found = await to_thread.run_sync(shared.jobs.store.jobs, owner_of(request))
    return JSONResponse({"jobs": [job_document(job) for job in found]}, headers=NEVER_KEPT)


@router.get(
    "/jobs/{job_id}",
    summary="Look at a job",
    description="How far it is. One that is unknown, of another owner, or was deleted a while "
    "after its end is a 404 with the code `job_unknown`.",
    response_class=JSONResponse,
    responses={
        200: {"description": "The job.", "model": Job, "headers": _RETRY},
        **documented(404, 500, 503),
    },
)
async def get_job(request: Request, job_id: JobId, shared: Shared) -> Response:
    job = await to_thread.run_sync(shared.jobs.store.get, job_id, owner_of(request))
    headers = {**NEVER_KEPT, **({"Retry-After": str(RETRY_S)} if job.is_open else {})}
    return JSONResponse(job_document(job), headers=headers)


@router.delete(
    "/jobs/{job_id}",
    summary="Cancel or remove a job",
    description="Ends one that waits or is in work; what was made is deleted. One that is "
    "finished is removed with its result.",
    response_class=JSONResponse,
    responses={
        200: {"description": "The job, now cancelled.", "model": Job},
        204: {"description": "It was finished, and is removed."},
        **documented(404, 500, 503),
        403: documented(403)[403],
    },
)
async def end_job(request: Request, job_id: JobId, shared: Shared) -> Response:
    job = await to_thread.run_sync(shared.jobs.store.end, job_id, owner_of(request))
    if job is None:
        return Response(status_code=204)
    return JSONResponse(job_document(job), headers=NEVER_KEPT)


@router.get(
    "/jobs/{job_id}/result",
    summary="Fetch what a job has made",
    description="The zip that the same request without `Prefer` is answered with, byte for byte.",
    response_class=Response,
    responses={
        200: {
            "description": "The zip.",
            "content": {MEDIA_TYPE: BINARY},
            "headers": {"Content-Disposition": MESH_HEADERS["Content-Disposition"]},
        },
        **documented(404, 409, 500, 503),
    },
)
async def get_result(request: Request, job_id: JobId, shared: Shared) -> Response:
    job = await to_thread.run_sync(shared.jobs.store.get, job_id, owner_of(request))
    if job.is_open:
        raise Conflict(
            "job_not_finished",
            f"The job has made {job.done} of {job.total} variants.",
            "Come back after as many seconds as Retry-After says, or follow its events.",
        )
    if job.status == "failed":
        raise Conflict(
            "job_failed",
            "The job could not be carried out and has no result.",
            f"GET /jobs/{job.id} tells its problem.",
        )
    if job.status == "cancelled":
        raise Conflict(
            "job_cancelled", "The job was cancelled and has no result.", "Send the request anew."
        )
    return zip_response(job.name, shared.jobs.result(job), dict(NEVER_KEPT))
