"""What one request's time goes into, by stage.

An interface that takes a request records it within `recording`; the stages below it are named by
`stage`, which only keeps the deadline where nothing is recorded.  The record travels in a context
variable, as the deadline does.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from service import deadline

STAGES = ("queue", "read", "encode", "refine", "bind", "transfer", "write")
"""Names of the stages, in the order of a request: waiting for a worker, reading the file, the
networks, the fit to the mesh, binding the mesh to the template, moving it, writing the answer."""


@dataclass(frozen=True)
class Interval:
    """A piece of work on a stage.

    Attributes:
        start: in seconds since the epoch.
        seconds: that it took itself, without the stages within it.
        whole: with those.
    """

    stage: str
    start: float
    seconds: float
    whole: float


@dataclass
class Record:
    """The stages of one request, for one thread at a time."""

    intervals: list[Interval] = field(default_factory=list)
    _within: list[float] = field(default_factory=list)

    def add(self, stage: str, start: float, seconds: float, whole: float | None = None) -> None:
        """Note work as `Interval` has it; by default it had no stages within."""
        self.intervals.append(Interval(stage, start, seconds, seconds if whole is None else whole))

    @property
    def seconds(self) -> dict[str, float]:
        """Of each stage that there was, in the order of `STAGES`."""
        found = {interval.stage for interval in self.intervals}
        return {
            stage: sum(i.seconds for i in self.intervals if i.stage == stage)
            for stage in STAGES
            if stage in found
        }

    @contextmanager
    def measured(self, stage: str) -> Iterator[None]:
        """Note the time of the block; that of stages within it counts as theirs alone."""
        epoch, start = time.time(), time.perf_counter()
        self._within.append(0.0)
        try:
            yield
        finally:
            whole = time.perf_counter() - start
            self.add(stage, epoch, whole - self._within.pop(), whole)
            if self._within:
                self._within[-1] += whole


_current: ContextVar[Record | None] = ContextVar("record", default=None)


@contextmanager
def recording(record: Record) -> Iterator[None]:
    """Note the stages of what this thread does within the block."""
    token = _current.set(record)
    try:
        yield
    finally:
        _current.reset(token)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Work on a stage, begun only while there is time.

    Raises:
        TooComplex, Overloaded, Abandoned: as `deadline.check`.
    """
    deadline.check()
    record = _current.get()
    if record is None:
        yield
        return
    with record.measured(name):
        yield
