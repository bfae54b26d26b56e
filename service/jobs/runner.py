"""The thread that carries jobs out: one at a time, a variant at a time, behind all requests."""

from __future__ import annotations

import logging
import secrets
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from threading import Event, Thread
from typing import TypeVar

from service import deadline, logs
from service.encode.basemodel import Model
from service.errors import Overloaded, ShapeError, TooComplex
from service.inferences import Inferences
from service.jobs.job import Failure, Job
from service.jobs.making import Making, Part, failed, making
from service.jobs.order import Order
from service.jobs.store import JobStore, LeaseLost
from service.mesh import limits
from service.priority import LEAST, stand_back
from service.requests import Upload

POLL_S = 1.0
"""How often a job of another process is looked for."""
WATCH_S = 0.25
"""How often a job that is worked on is looked at: whether it is still wanted."""
RENEW_S = 5.0
SWEEP_S = 30.0
PATIENCE_S = 1.0
"""How long a variant waits while requests take all workers."""
ATTEMPTS = 3
"""How often a job is taken up that comes no further."""

T = TypeVar("T")

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Surroundings:
    """What a runner works in.

    Attributes:
        models: those of the moment, or `ModelFault` while there are none.
        known: inferences that are kept.
        seconds: the deadline of each variant, and of the inference before them.
        vertices: of the largest mesh.
        busy: whether requests take all workers.
        draining: whether the service is about to stop.
    """

    models: Callable[[], Mapping[str, Model]]
    known: Inferences
    seconds: float
    vertices: int
    busy: Callable[[], bool]
    draining: Callable[[], bool]


class Runner:
    """Carries out the jobs of a store until it is stopped, or the service drains.

    Attributes:
        made: variants, by kind of job and whether there is a file (`ok`) or none (`failed`).
        ended: jobs, by kind and status.
    """

    def __init__(self, store: JobStore, surroundings: Surroundings) -> None:
        self.made: Counter[tuple[str, str]] = Counter()
        self.ended: Counter[tuple[str, str]] = Counter()
        self._store = store
        self._around = surroundings
        self._stopping = Event()
        self._awake = Event()
        self._thread: Thread | None = None
        self._swept = -float("inf")

    def start(self) -> None:
        """Begin, once."""
        if self._thread is None:
            self._thread = Thread(target=self._run, name="jobs", daemon=True)
            self._thread.start()

    def wake(self) -> None:
        """There is a new job."""
        self._awake.set()

    def stop(self, seconds: float = 5.0) -> None:
        """End, and let others have the job that is worked on; waits so long at most."""
        self._stopping.set()
        self._awake.set()
        if self._thread is not None:
            self._thread.join(seconds)

    @property
    def _over(self) -> bool:
        return self._stopping.is_set() or self._around.draining()

    def _run(self) -> None:
        stand_back(LEAST)
        while not self._over:
            try:
                worked = self._turn()
            except ShapeError:
                worked = False  # the models load, or the store has complained
            except Exception:
                logger.exception("the jobs' runner goes on after a fault")
                worked = False
            if not worked:
                self._awake.wait(POLL_S)
                self._awake.clear()

    def _turn(self) -> bool:
        """Carry out a job; False when there is none."""
        now = time.monotonic()
        if now - self._swept > SWEEP_S:
            self._swept = now
            self._store.sweep()
        models = self._around.models()
        if not self._store.waiting():
            return False
        lease = secrets.token_hex(16)
        taken = self._store.claim(lease)
        if taken is None:
            return False
        job, upload = taken
        with logs.about(logs.Identity(job.trace_id, job.id)):
            self._work(job, upload, lease, models)
        return True

    def _work(self, job: Job, upload: Upload, lease: str, models: Mapping[str, Model]) -> None:
        _log("job taken up", job)
        abandoned = Event()
        over = Event()
        watch = Thread(target=self._watch, args=(job, lease, abandoned, over), daemon=True)
        watch.start()
        try:
            failure = self._carry_out(job, upload, lease, models, abandoned)
        except (deadline.Abandoned, LeaseLost):
            _log("job left", job)
            with suppress(ShapeError):
                self._store.release(job.id, lease)
        except Overloaded:
            with suppress(ShapeError):
                self._store.release(job.id, lease, failed=True)
            self._stopping.wait(POLL_S)
        else:
            with suppress(LeaseLost):
                ended = self._store.finish(job.id, lease, failure)
                self.ended[job.kind, ended.status] += 1
                _log(f"job {ended.status}", ended, failure.code if failure else "")
        finally:
            over.set()
            watch.join()

    def _carry_out(
        self, job: Job, upload: Upload, lease: str, models: Mapping[str, Model], abandoned: Event
    ) -> Failure | None:
        """Make what is left of its variants; why it can't be done, if so."""
        order = Order.read(job.order, upload)
        if job.attempts > ATTEMPTS:
            return Failure.of(_interrupted(job))
        try:
            makers = order.makers(models)
            begin = job.done
            if job.makers != makers:
                # All of a job's variants are made by the same models.
                self._store.restart(job.id, lease, makers)
                begin = 0
            self._make(order, job.id, lease, begin, models, abandoned)
        except Overloaded as error:
            if error.code == "jobs_unavailable" or job.attempts < ATTEMPTS:
                raise
            return Failure.of(error)
        except ShapeError as error:
            return Failure.of(error)
        except LeaseLost:
            raise
        except Exception as error:
            logger.exception("job %s can't be carried out", job.id)
            return Failure.of(error)
        return None

    def _make(
        self,
        order: Order,
        job_id: str,
        lease: str,
        begin: int,
        models: Mapping[str, Model],
        abandoned: Event,
    ) -> None:
        with ExitStack() as stack:
            opened = making(order, models, self._around.known)
            made = self._limited(abandoned, lambda: stack.enter_context(opened))
            for index in range(begin, order.total):
                self._stand_aside(abandoned)
                part = self._part(order, made, index, abandoned)
                self._store.save(job_id, lease, index, part)
                self.made[order.kind, "failed" if part.data is None else "ok"] += 1
            labels = self._limited(abandoned, made.labels)
            if labels is not None:
                self._store.save_labels(job_id, lease, labels)

    def _part(self, order: Order, made: Making, index: int, abandoned: Event) -> Part:
        """A variant; one that can't be made spoils no other."""
        for attempt in range(1, ATTEMPTS + 1):
            try:
                return self._limited(abandoned, lambda: made.part(index))
            except Overloaded as error:
                if attempt == ATTEMPTS:
                    return failed(order, index, error)
            except TooComplex as error:
                return failed(order, index, error)
            except Exception as error:
                logger.exception("variant %d can't be made", index)
                return failed(order, index, error)
        raise AssertionError

    def _limited(self, abandoned: Event, work: Callable[[], T]) -> T:
        around = self._around
        with deadline.limit(around.seconds, abandoned), limits.at_most(around.vertices):
            deadline.check()
            return work()

    def _stand_aside(self, abandoned: Event) -> None:
        """Requests first: for a while, since jobs must not wait for ever either."""
        end = time.monotonic() + PATIENCE_S
        while self._around.busy() and time.monotonic() < end and not abandoned.is_set():
            abandoned.wait(0.02)

    def _watch(self, job: Job, lease: str, abandoned: Event, over: Event) -> None:
        """Hold on to a job, and end the work on it once it is in vain."""
        renewed = time.monotonic()
        while not over.wait(WATCH_S):
            try:
                if self._over or not self._store.holds(job.id, lease):
                    abandoned.set()
                    return
                if time.monotonic() - renewed > RENEW_S:
                    self._store.renew(job.id, lease)
                    renewed = time.monotonic()
            except LeaseLost:
                abandoned.set()
                return
            except ShapeError:
                continue  # complained of by the store


def _interrupted(job: Job) -> Overloaded:
    return Overloaded(
        "job_interrupted",
        f"The service stopped {job.attempts - 1} times amid variant {job.done}.",
        "Leave that variant out, or send a simpler mesh.",
    )


def _log(what: str, job: Job, code: str = "") -> None:
    fields = {
        "job": job.id,
        "kind": job.kind,
        "status": job.status,
        "done": job.done,
        "total": job.total,
        "owner": job.owner,
        "code": code,
    }
    shown = {name: value for name, value in fields.items() if value != ""}
    logger.info("%s: %s, %d of %d", what, job.id, job.done, job.total, extra={logs.FIELDS: shown})
