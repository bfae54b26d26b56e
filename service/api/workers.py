"""The bounded pool of threads that work on meshes, off the event loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar, TypeVarTuple

from anyio import CapacityLimiter, to_thread

from service import deadline

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")


class Workers:
    """Runs at most `count` functions at once; more wait their turn.

    Probes and small answers stay on the event loop, so that they come at once however busy the
    pool is.
    """

    def __init__(self, count: int, seconds: float = math.inf) -> None:
        """`seconds` is the deadline of each function, from when a thread takes it up."""
        self.count = count
        self._seconds = seconds
        self._limiter = CapacityLimiter(count)

    async def run(self, function: Callable[[*Arguments], T], *arguments: *Arguments) -> T:
        """The function's result, computed in a thread; its error is raised here."""

        def work() -> T:
            with deadline.limit(self._seconds):
                return function(*arguments)

        return await to_thread.run_sync(work, limiter=self._limiter)
