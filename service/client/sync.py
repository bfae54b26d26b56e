"""The client that blocks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import TracebackType
from typing import Self, TypeVar, Unpack

import httpx

from service.client import calls
from service.client.call import Answer, Call, Sending
from service.client.config import Config
from service.client.drivers import Driver
from service.client.exchange import exchange
from service.client.files import Archive, Edited, File
from service.client.follow import Follow
from service.client.mesh import Mesh, MeshLike
from service.client.models import (
    Alive,
    Category,
    EditReport,
    Event,
    InferReport,
    Job,
    Ready,
    TransferReport,
)
from service.client.options import (
    Augmenting,
    Editing,
    EditingReport,
    How,
    Offering,
    Reading,
    Saving,
    SubmittingAugment,
    SubmittingEdits,
    Transferring,
    TransferringReport,
    VaryingEdits,
)
from service.client.retry import Retry
from service.client.values import Values
from service.client.waiting import OnProgress, at_end

T = TypeVar("T")


class ShapeClient:
    """The service, as calls that block.

        with ShapeClient("https://shapes.example") as client:
            client.edit("chair.glb", {"seat_width": scale(1.2)}).save("wide.glb")

    It may be shared by threads.  Every call makes its attempts as `Retry` says, sends a mesh again
    that the service has dropped, and raises `ServiceError`s: see `service.client.errors`.  A mesh
    is a path, bytes, a binary file, a `Mesh`, a file that was answered, or a mesh_id.  A wrong
    argument is a TypeError or ValueError, and a file that can't be read or written an OSError.

    Args:
        url: of the service; by default that of `http`, else `SHAPE_URL` of the environment, else
            http://127.0.0.1:8000.
        api_key: by default `SHAPE_API_KEY` of the environment; empty for none.  It goes to the
            service alone: redirects are not followed, and nothing shows it.
        timeout: seconds or `httpx.Timeout` of each call.
        retries: how calls are made again; `Retry(attempts=1)` for never.
        http: an `httpx.Client` to use, such as starlette's `TestClient`; it is left open.
        transport: instead, what an own one is to send with.
        sleep: waits so many seconds.

    Raises:
        ValueError: when the URL or the key can't be one.
    """

    def __init__(
        self,
        url: str | None = None,
        api_key: str | None = None,
        timeout: float | httpx.Timeout | None = None,
        retries: Retry | None = None,
        http: httpx.Client | None = None,
        transport: httpx.BaseTransport | None = None,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        at = "" if http is None else str(http.base_url)
        self._config = Config.of(url, api_key, timeout, retries, at)
        self._own = http is None
        self._http = http or httpx.Client(transport=transport)
        self._driver = Driver(self._http, sleep)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._config.shown!r})"

    def close(self) -> None:
        """Close its connections."""
        if self._own:
            self._http.close()

    def infer(self, mesh: MeshLike, **options: Unpack[Reading]) -> InferReport:
        """What the parameters of a mesh are.

        Args:
            mesh: what to read; a `Mesh` learns its id, and later calls send but that.
            options: `Reading`: category, up, front, units, refine; `How`.

        Returns:
            The parameters with standard deviations, the dimensions that follow, and the fit.

        Raises:
            NotRecognised: when it is of no known category.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.infer(mesh, options))

    def edit(
        self, mesh: MeshLike, edits: Values | str | None = None, **options: Unpack[Editing]
    ) -> Edited:
        """The same file with its parameters changed.

        Args:
            mesh: what to edit.
            edits: by name `scale(1.2)`, `add(0.05)`, `set_to(0.45)`, the like as plain dicts, or a
                number, which sets.  None where there are constraints.
            options: `Editing`: constraints, mode, keep, format, strict, to; those of `infer`.

        Returns:
            The file, and the parameters' values after the edit.

        Raises:
            ConstraintsConflict: when constraints contradict each other.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.edit(mesh, edits, options))

    def edit_report(
        self, mesh: MeshLike, edits: Values | str | None = None, **options: Unpack[EditingReport]
    ) -> EditReport:
        """What would become of a mesh by an edit; the edited one is kept under its `mesh_id`.

        Args:
            mesh, edits: as of `edit`.
            options: those of `edit` but `to`.

        Returns:
            The values before and after; `mesh(report.mesh_id)` is the edited file.

        Raises:
            ServiceError: as `edit`.
        """
        return self.request(calls.edit_report(mesh, edits, options))

    def edit_variants(
        self,
        mesh: MeshLike,
        variants: Sequence[Values] | str,
        **options: Unpack[VaryingEdits],
    ) -> Archive:
        """Many edits of one mesh.

        Args:
            mesh: what to edit.
            variants: 1 to 1000 of what `edit` takes as edits.
            options: `VaryingEdits`: mode, keep, format, strict, to; those of `infer`.

        Returns:
            A zip; its manifest has a row a variant, also for those that could not be made.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.edit_variants(mesh, variants, options))

    def sliders(self, mesh: MeshLike, **options: Unpack[Offering]) -> File:
        """A GLB of the mesh that any viewer edits, with a slider a parameter.

        Args:
            mesh: what to put them into.
            options: `Offering`: parameters, keep, paired, quantize, joint_names, rest, to; those of
                `infer`.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.made("/sliders", mesh, options))

    def template(self, mesh: MeshLike, **options: Unpack[Offering]) -> File:
        """A GLB of what was fitted to the mesh, in the mesh's place, with the same sliders.

        Args:
            mesh, options: as of `sliders`.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.made("/template", mesh, options))

    def transfer(
        self, source: MeshLike, target: MeshLike, **options: Unpack[Transferring]
    ) -> Edited:
        """The source's file with the parameters of the target.

        Args:
            source: what to edit.
            target: what to take the parameters from; of the same category.
            options: `Transferring`: parameters, size, position, target_up, target_front,
                target_units, mode, keep, format, strict, to; those of `infer`, for the source.

        Returns:
            The file, and the parameters' values after the edit.

        Raises:
            CategoriesDiffer: when they are of two categories.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.transfer(source, target, options))

    def transfer_report(
        self, source: MeshLike, target: MeshLike, **options: Unpack[TransferringReport]
    ) -> TransferReport:
        """What a transfer makes of the source; the edited mesh is kept under its `mesh_id`.

        Args:
            source, target: as of `transfer`.
            options: those of `transfer` but `to`.

        Raises:
            ServiceError: as `transfer`.
        """
        return self.request(calls.transfer_report(source, target, options))

    def augment(self, mesh: MeshLike, **options: Unpack[Augmenting]) -> Archive:
        """Random variants of a mesh, for training data.

        Args:
            mesh: what to vary.
            options: `Augmenting`: count, seed, strength, mode, keep, format, to; those of `infer`.

        Returns:
            A zip of the variants, with a manifest and the part of each vertex.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.augment(mesh, options))

    def submit_edit(
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
        return self.request(calls.submit_edit(mesh, variants, options))

    def submit_augment(self, mesh: MeshLike, **options: Unpack[SubmittingAugment]) -> Job:
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
        return self.request(calls.submit_augment(mesh, options))

    def jobs(self, **options: Unpack[How]) -> list[Job]:
        """One's own jobs, the newest first.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.jobs(options)).jobs

    def job(self, job: Job | str, **options: Unpack[How]) -> Job:
        """A job as it stands now.

        Args:
            job: or its id.

        Raises:
            JobUnknown: when it is expired or was never there.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.job(job, options))

    def events(
        self, job: Job | str, timeout: float | None = None, last_event_id: str | None = None
    ) -> Iterator[Event]:
        """A job's changes as they come, to its end.

        The service tells them; where the connection breaks it is made again, from the last that was
        heard, and where there are no events the service is asked now and then.

        Args:
            job: or its id.
            timeout: seconds after which to give up; by default never.
            last_event_id: hear but what came after.

        Raises:
            TimedOut: when it is not finished in time.
            ServiceError: see `service.client.errors`.
        """
        return self._driver.events(Follow(job, self._config, timeout, last_event_id).steps())

    def wait(
        self,
        job: Job | str,
        on_progress: OnProgress | None = None,
        timeout: float | None = None,
    ) -> Job:
        """Wait until a job is finished.

        Args:
            job: or its id.
            on_progress: called with the job at each change.
            timeout: seconds after which to give up; by default never.  The job goes on.

        Returns:
            The finished job: succeeded, failed or cancelled, as its `status` says.

        Raises:
            TimedOut: when it is not finished in time.
            ServiceError: see `service.client.errors`.
        """
        last = None
        for event in self.events(job, timeout):
            last = event.job
            if on_progress is not None:
                on_progress(last)
        return at_end(last)

    def result(self, job: Job | str, **options: Unpack[Saving]) -> Archive:
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
        return self.request(calls.result(job, options))

    def cancel(self, job: Job | str, **options: Unpack[How]) -> Job | None:
        """Stop a job, or remove one that is finished.

        Args:
            job: or its id.

        Returns:
            The cancelled job; None where it was finished and is removed.

        Raises:
            JobUnknown: when it is not there.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.cancel(job, options))

    def categories(self, **options: Unpack[How]) -> list[Category]:
        """What can be edited, with all parameters.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.categories(options)).categories

    def category(self, name: str, **options: Unpack[How]) -> Category:
        """One category.

        Args:
            name: such as `chair`, or `chair@1.0.0` for one version of its model.

        Raises:
            CategoryUnknown: when there is none.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.category(name, options))

    def mesh(self, mesh_id: str | Mesh, **options: Unpack[Saving]) -> File:
        """A mesh that the service keeps, byte for byte.

        Args:
            mesh_id: as a report named it, or a `Mesh` that knows its own.
            options: `Saving`: to; `How`.

        Raises:
            MeshUnknown: when it is not kept any more.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.mesh(mesh_id, options))

    def ready(self, **options: Unpack[How]) -> Ready:
        """Which models are served; waits as long as retries go where they still load.

        Raises:
            Unavailable: when it is not ready by then.
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.ready(options))

    def alive(self, **options: Unpack[How]) -> Alive:
        """Whether the service runs at all.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self.request(calls.alive(options))

    def request(self, call: Call[T]) -> T:
        """Carry out any call; the methods here are each one of `service.client.calls`.

        Args:
            call: what is sent, and how the answer is read.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return self._driver.run(exchange(call, self._config))

    def post(
        self,
        path: str,
        fields: Mapping[str, str] | Sequence[tuple[str, str]] = (),
        files: Mapping[str, MeshLike] | Sequence[tuple[str, MeshLike]] = (),
        headers: Mapping[str, str] | None = None,
        method: str = "POST",
    ) -> Answer:
        """A form as it stands: what no method here would send.

        Args:
            path: with a slash at its beginning.
            fields, files: of the form; pairs where a name repeats.  Files go whole.
            headers: beside the client's own.
            method: only a POST has a body.

        Returns:
            Status, headers and content of a success.

        Raises:
            ServiceError: as of every call.
        """
        return self.request(calls.plain(method, path, fields, files, headers, Sending()))
