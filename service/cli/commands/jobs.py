"""`shape-edit jobs`: what goes on at a service."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from service.cli.destination import Destination, write
from service.cli.options import telling_options, where_options
from service.cli.output import Output
from service.cli.problem import FAILED, Problem

if TYPE_CHECKING:
    from service.client import ShapeClient
    from service.client.models import Job

JOB = click.argument("job", metavar="ID")


@click.group()
def jobs() -> None:
    """See to what a service at --url works on in the background.

    Augmentations at a service, and calls with `Prefer: respond-async`, are jobs.

    \b
    Examples:
      shape-edit jobs list --url http://127.0.0.1:8000
      shape-edit jobs wait job-4Tn0X9yKJ1cQm2vB7sLdZw -o variants.zip
    """


def _remote(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the client, and its output; problems are told."""

    @wraps(command)
    def run(url: str | None, api_key: str | None, as_json: bool, quiet: bool, **given: Any) -> None:
        if url is None:
            raise click.UsageError("Jobs are at a service: say --url, or set SHAPE_URL.")
        from service.cli.clientfaults import told
        from service.cli.remote import Remote

        output = Output(as_json, quiet)
        client = Remote(url, api_key).client
        click.get_current_context().call_on_close(client.close)
        try:
            with told():
                command(client, output, **given)
        except Problem as problem:
            output.failed(problem)
        output.finish()

    return telling_options()(where_options()(run))


@jobs.command("list")
@_remote
def list_jobs(client: ShapeClient, output: Output) -> None:
    """List your jobs, the newest first.

    \b
    Examples:
      shape-edit jobs list
      shape-edit jobs list --json
    """
    from service.cli import tables
    from service.cli.remote import document

    found = client.jobs()
    output.document({"jobs": [document(job) for job in found]})
    output.show(tables.jobs(document(job) for job in found))


@jobs.command()
@JOB
@_remote
def show(client: ShapeClient, output: Output, job: str) -> None:
    """Show how far a job is.

    \b
    Examples:
      shape-edit jobs show job-4Tn0X9yKJ1cQm2vB7sLdZw
    """
    _tell(client.job(job), output)


@jobs.command()
@JOB
@click.option("-o", "--output", "out", metavar="FILE", help="Write the result, a zip, there.")
@click.option("-f", "--force", is_flag=True, help="Replace the file if it is there already.")
@click.option("--timeout", type=float, metavar="SECONDS", help="After which to give up waiting.")
@_remote
def wait(
    client: ShapeClient, output: Output, job: str, out: str | None, force: bool,
    timeout: float | None,
) -> None:  # fmt: skip
    """Wait until a job is finished; the exit code is 0 if it succeeded.

    \b
    Examples:
      shape-edit jobs wait job-4Tn0X9yKJ1cQm2vB7sLdZw
      shape-edit jobs wait job-4Tn0X9yKJ1cQm2vB7sLdZw -o variants.zip
    """
    place = None if out is None else Destination(out, force, "result").path(job, job, "zip")
    with output.counting(job) as tell:
        end = client.wait(job, lambda now: tell(now.progress.done, now.progress.total, 0), timeout)
    if end.status == "succeeded" and place is not None:
        write(Path(place), client.result(end).data)
    _tell(end, output)
    if end.status != "succeeded":
        raise click.exceptions.Exit(FAILED)


@jobs.command()
@JOB
@_remote
def cancel(client: ShapeClient, output: Output, job: str) -> None:
    """Cancel a job; one that is finished is removed with its result.

    \b
    Examples:
      shape-edit jobs cancel job-4Tn0X9yKJ1cQm2vB7sLdZw
    """
    left = client.cancel(job)
    if left is not None:
        _tell(left, output)
    else:
        output.document({"id": job, "status": "removed"})
        output.show(f"{job} is removed")


def _tell(job: Job, output: Output) -> None:
    from service.cli import tables
    from service.cli.remote import document

    output.document(document(job))
    output.show(tables.jobs([document(job)]))
    if job.problem is not None:
        output.show(*tables.warnings([f"{job.problem['code']}: {job.problem['detail']}"]))
