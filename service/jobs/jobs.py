"""Jobs as an interface sees them: asked for, looked at, ended."""

from __future__ import annotations

from collections.abc import Iterator

from service.jobs.archive import archive
from service.jobs.job import Job
from service.jobs.order import Order
from service.jobs.runner import Runner
from service.jobs.store import JobStore


class Jobs:
    """A store and its runner, which begins with `start` or with the first job.

    Attributes:
        store, runner: the two.
        streams: clients that are being told of a job.
    """

    def __init__(self, store: JobStore, runner: Runner) -> None:
        self.store = store
        self.runner = runner
        self.streams = 0

    def start(self) -> None:
        """Go on with what an earlier process has left."""
        self.runner.start()

    def submit(self, order: Order, owner: str, trace_id: str, key: str | None) -> Job:
        """See `JobStore.submit`."""
        job = self.store.submit(order, owner, trace_id, key)
        self.runner.start()
        self.runner.wake()
        return job

    def result(self, job: Job) -> Iterator[bytes]:
        """The zip of a job that has succeeded, piece by piece."""
        return archive(self.store.files(job.id, job.total))

    def close(self) -> None:
        """Stop, and let another process go on."""
        self.runner.stop()
        self.store.close()
