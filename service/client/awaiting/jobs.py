"""Jobs: what goes on after its call was answered."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Sequence
from contextlib import aclosing
from typing import Unpack

from service.client import calls
from service.client.awaiting.base import Caller
from service.client.files import Archive
from service.client.follow import Follow
from service.client.mesh import MeshLike
from service.client.models import Event, Job
from service.client.options import How, Saving, SubmittingAugment, SubmittingEdits
from service.client.values import Values
from service.client.waiting import OnProgress, at_end


class JobCalls(Caller):
    """What goes on after its call was answered."""

    async def submit_edit(
        self,
        mesh: MeshLike,
        variants: Sequence[Values] | str,
        **options: Unpack[SubmittingEdits],
    ) -> Job:
        """Start `edit_variants` as a job.

        Args:
            mesh, variants: as of `edit_variants`.
            options: its own but `to`; idempotency_key.

        Returns:
            The job, to `wait` for and to take the `result` of.

        Raises:
            TooManyRequests: `jobs_full`, also after the retries.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.submit_edit(mesh, variants, options))

    async def submit_augment(self, mesh: MeshLike, **options: Unpack[SubmittingAugment]) -> Job:
        """Start `augment` as a job.

        Args:
            mesh: what to vary.
            options: those of `augment` but `to`; idempotency_key.

        Returns:
            The job, to `wait` for and to take the `result` of.

        Raises:
            TooManyRequests: `jobs_full`, also after the retries.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.submit_augment(mesh, options))

    async def jobs(self, **options: Unpack[How]) -> list[Job]:
        """One's own jobs, the newest first.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return (await self.request(calls.jobs(options))).jobs

    async def job(self, job: Job | str, **options: Unpack[How]) -> Job:
        """A job as it stands now.

        Args:
            job: or its id.

        Raises:
            JobUnknown: when it is expired or was never there.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.job(job, options))

    def events(
        self, job: Job | str, timeout: float | None = None, last_event_id: str | None = None
    ) -> AsyncGenerator[Event, None]:
        """A job's changes as they come, to its end.

        The service tells them; where the connection breaks it is made again, from the last that was
        heard, and where there are no events the service is asked now and then.
        Who leaves before the end is to close it, and with it the connection: `contextlib.closing`,
        `aclosing`.

        Args:
            job: or its id.
            timeout: seconds after which to give up, as `wait` does; by default never.
            last_event_id: hear but what came after.

        Raises:
            TimedOut: when it is not finished in time.
            ServiceError: see `service.client.errors`.
        """
        return self._driver.events(Follow(job, self._config, timeout, last_event_id).steps())

    async def wait(
        self,
        job: Job | str,
        on_progress: OnProgress | None = None,
        timeout: float | None = None,
    ) -> Job:
        """Wait until a job is finished.

        Args:
            job: or its id.
            on_progress: called with the job at each change.
            timeout: seconds after which to give up, or at the next sign of life after that (the
                service gives one every ten seconds); by default never.  The job goes on.

        Returns:
            The finished job: succeeded, failed or cancelled, as its `status` says.

        Raises:
            TimedOut: when it is not finished in time.
            ServiceError: see `service.client.errors`.
        """
        last = None
        async with aclosing(self.events(job, timeout)) as events:
            async for event in events:
                last = event.job
                if on_progress is not None:
                    on_progress(last)
        return at_end(last)

    async def result(self, job: Job | str, **options: Unpack[Saving]) -> Archive:
        """What a job has made.

        Args:
            job: or its id.
            options: `Saving`: to; `How`.

        Returns:
            The zip that `edit_variants` or `augment` answers.

        Raises:
            JobNotFinished: when it is at work still.
            JobFailed, JobCancelled: when it has no result.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.result(job, options))

    async def cancel(self, job: Job | str, **options: Unpack[How]) -> Job | None:
        """Stop a job, or remove one that is finished.

        Args:
            job: or its id.

        Returns:
            The cancelled job; None where it was finished and is removed.

        Raises:
            JobUnknown: when it is not there.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.cancel(job, options))
