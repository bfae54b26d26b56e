"""The bounded pool of threads that work on meshes, off the event loop."""

from __future__ import annotations

import math
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, nullcontext
from functools import partial
from threading import Event
from typing import TypeVar, TypeVarTuple

from anyio import CancelScope, CapacityLimiter, Semaphore, create_task_group, to_thread
from fastapi import Request
from starlette.types import Receive

from service import deadline, stages
from service.api.left import ClientLeft
from service.errors import Overloaded
from service.mesh import limits
from service.priority import stand_back

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")

WEIGHT = 0.1
"""Of the latest request in the mean of how long they take."""

NICENESS = 10
"""By how much a working thread stands back behind the event loop's, which answers probes in half
the time so."""


class Workers:
    """Runs at most `count` functions at once; more wait their turn, first come, first served.

    Probes and small answers stay on the event loop, so that they come at once however busy the
    pool is.

    Attributes:
        working, queued: functions that run, and that wait, now.
        pace: seconds that a request takes a worker, a moving mean; 0 before the first.
    """

    def __init__(
        self, count: int, seconds: float = math.inf, vertices: int = limits.VERTICES
    ) -> None:
        """
        Args:
            count: of threads.
            seconds: the deadline of each function, from when a thread takes it up.
            vertices: of the largest mesh that a function may read.
        """
        self.count = count
        self.working = 0
        self.queued = 0
        self.pace = 0.0
        self._seconds = seconds
        self._vertices = vertices
        self._turn = Semaphore(count)
        # The threads are this pool's alone: whoever has the turn waits for none.
        self._threads = CapacityLimiter(count)

    async def run(
        self, request: Request, function: Callable[[*Arguments], T], *arguments: *Arguments
    ) -> T:
        """The function's result, computed in a thread; its error is raised here.

        The function is for the client of the request, whose body has been read: should the client
        leave, it is not begun any more, or ends where it next looks at its deadline.

        Raises:
            ClientLeft: nobody waits for the result.
            Overloaded: the turn did not come within the deadline.
        """
        abandoned = Event()
        work = partial(function, *arguments)
        try:
            record: stages.Record | None = getattr(request.state, "record", None)
            return await self._while_there(request.receive, work, abandoned, record)
        finally:
            # Ends work whose request was cancelled by the server.
            abandoned.set()

    async def _while_there(
        self,
        receive: Receive,
        work: Callable[[], T],
        abandoned: Event,
        record: stages.Record | None,
    ) -> T:
        results: list[T] = []
        failure: BaseException | None = None
        async with create_task_group() as tasks:
            tasks.start_soon(_listen, receive, abandoned, tasks.cancel_scope)
            # Errors are caught here: the group would wrap them.
            try:
                async with self._in_turn(record):
                    begun = time.monotonic()
                    try:
                        results.append(await self._in_thread(work, abandoned, record))
                    finally:
                        self._keep_pace(time.monotonic() - begun)
            except (Exception, deadline.Abandoned) as error:
                failure = error
            tasks.cancel_scope.cancel()
        if abandoned.is_set():
            raise ClientLeft
        if failure is not None:
            raise failure
        return results[0]

    @asynccontextmanager
    async def _in_turn(self, record: stages.Record | None) -> AsyncIterator[None]:
        epoch, start = time.time(), time.monotonic()
        self.queued += 1
        try:
            await self._turn.acquire()
        finally:
            self.queued -= 1
        self.working += 1
        try:
            waited = time.monotonic() - start
            if record is not None:
                record.add("queue", epoch, waited)
            if waited > self._seconds:
                raise Overloaded(
                    "deadline_exceeded",
                    f"No worker was free within {self._seconds:g} s.",
                    "Send the request again a little later.",
                )
            yield
        finally:
            self.working -= 1
            self._turn.release()

    async def _in_thread(
        self, work: Callable[[], T], abandoned: Event, record: stages.Record | None
    ) -> T:
        def limited() -> T:
            stand_back(NICENESS)
            noted = nullcontext() if record is None else stages.recording(record)
            with (
                deadline.limit(self._seconds, abandoned),
                limits.at_most(self._vertices),
                noted,
            ):
                return work()

        return await to_thread.run_sync(limited, limiter=self._threads)

    def _keep_pace(self, seconds: float) -> None:
        self.pace += (WEIGHT if self.pace else 1.0) * (seconds - self.pace)


async def _listen(receive: Receive, abandoned: Event, scope: CancelScope) -> None:
    """Once the client leaves, end what is done for it: the wait for a turn, or the work."""
    while (await receive())["type"] != "http.disconnect":
        pass
    abandoned.set()
    scope.cancel()
