"""A job as JSON, its problem as every other."""

from __future__ import annotations

from typing import Any

from service import errors
from service.api.problems import document, status_of
from service.jobs.job import Failure, Job


def job_document(job: Job) -> dict[str, Any]:
    """What clients are told of a job."""
    told = job.told()
    if job.problem is not None:
        failure = Failure.read(job.problem)
        kind = getattr(errors, failure.kind, None)
        status = 500 if kind is None else status_of(kind)
        own = failure.code, failure.detail, failure.suggestion, job.trace_id, failure.members
        told["problem"] = document(status, *own)
    return told
