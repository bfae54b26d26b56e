"""How long one request may be worked on, and whether anybody still waits for it.

The interface that takes a request works on it within `limit`; stages and long loops below it call
`check`, which does nothing where no limit is set.  The limit travels in a context variable, since
every signature from the readers to the deformation would have to carry it otherwise; functions
that call `check` give the same results with and without.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from threading import Event

from service.errors import Overloaded, TooComplex

OWN_WORK = 0.5
"""Share of the time that the work itself must have had on a CPU for it to be the upload's fault."""


class Abandoned(BaseException):
    """Nobody waits for the answer any more.

    No `Exception`, as a cancellation is none: what turns the errors of damaged files into answers
    has to let it pass.
    """


@dataclass(frozen=True)
class _Limit:
    """`seconds` from `start`, on a steady clock; `worked` is the thread's own at that time.

    `abandoned` is set once nobody waits for the answer.
    """

    seconds: float
    start: float
    worked: float
    abandoned: Event


_current: ContextVar[_Limit | None] = ContextVar("deadline", default=None)


@contextmanager
def limit(seconds: float, abandoned: Event | None = None) -> Iterator[None]:
    """Give what this thread does within the block so many `seconds`, until it is `abandoned`."""
    token = _current.set(
        _Limit(seconds, time.monotonic(), time.thread_time(), abandoned or Event())
    )
    try:
        yield
    finally:
        _current.reset(token)


def check() -> None:
    """Raise when the time is over, or the work is for nothing.

    Raises:
        Abandoned: nobody waits for it.
        TooComplex: most of it went into this very work, so that it would again.
        Overloaded: most of it went by while others worked; later there may be time.
    """
    current = _current.get()
    if current is None:
        return
    if current.abandoned.is_set():
        raise Abandoned
    if time.monotonic() - current.start <= current.seconds:
        return
    worked = time.thread_time() - current.worked
    if worked > OWN_WORK * current.seconds:
        raise TooComplex(
            "too_complex",
            f"Working on this mesh took more than {current.seconds:g} s.",
            "Simplify the mesh, or ask the operator to raise DEADLINE_SECONDS.",
        )
    raise Overloaded(
        "deadline_exceeded",
        f"The service was too busy to answer within {current.seconds:g} s.",
        "Send the request again a little later.",
    )
