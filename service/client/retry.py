"""When a call is made again, and after how long."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime

from service.client.errors import (
    AnswerMalformed,
    ConnectionFailed,
    ProblemError,
    ServiceError,
    TimedOut,
)

PROXY = frozenset({429, 502, 503, 504})
"""Statuses that a proxy gives on its own for what passes."""


@dataclass(frozen=True)
class Retry:
    """How often and how long a call that failed by no fault of its own is made again.

    That is: 429, 503 that says `Retry-After` (a model that can't be trusted says none), a proxy's
    502 to 504, no connection, a connection that broke, and no answer in time.  Every call can be
    made twice: they compute, and those that start a job carry an idempotency key.

    Attributes:
        attempts: at most, the first included; 1 for no retries.
        total_s: seconds within which the last attempt begins.
        base_s, cap_s: attempt ``n`` waits between 0 and ``min(cap_s, base_s 2^n)`` seconds; where
            the service says `Retry-After`, so long and up to `base_s` more.
        random: uniform in [0, 1).
        clock: seconds that only grow.
        now: the time of day, for a `Retry-After` that is a date.
    """

    attempts: int = 5
    total_s: float = 60.0
    base_s: float = 0.25
    cap_s: float = 8.0
    random: Callable[[], float] = field(default=random.random, repr=False)
    clock: Callable[[], float] = field(default=time.monotonic, repr=False)
    now: Callable[[], datetime] = field(default=lambda: datetime.now(UTC), repr=False)

    def __post_init__(self) -> None:
        if self.attempts < 1 or min(self.total_s, self.base_s, self.cap_s) < 0:
            raise ValueError(f"{self} makes no sense: attempts >= 1, seconds >= 0")

    def after(self, header: str | None) -> float | None:
        """Seconds that a `Retry-After` header asks for; None without one that can be read."""
        if header is None:
            return None
        if header.strip().isdecimal():
            return float(header)
        try:
            until = parsedate_to_datetime(header)
        except ValueError:
            return None
        if until.tzinfo is None:
            until = until.replace(tzinfo=UTC)
        return max(0.0, (until - self.now()).total_seconds())


NONE = Retry(attempts=1)
"""No second attempt."""


class Attempts:
    """Those of one call."""

    def __init__(self, retry: Retry) -> None:
        self.retry = retry
        self.made = 0
        self.began = retry.clock()

    def delay(self, fault: ServiceError) -> float:
        """Seconds until the next attempt.

        Raises:
            ServiceError: the fault itself, where there is to be none.
        """
        retry = self.retry
        self.made += 1
        if self.made >= retry.attempts or not passes(fault):
            raise fault
        jitter = retry.random()
        asked = getattr(fault, "retry_after", None)
        if asked is None:
            seconds = jitter * min(retry.cap_s, retry.base_s * 2.0 ** (self.made - 1))
        else:
            seconds = asked + jitter * retry.base_s
        if retry.clock() - self.began + seconds > retry.total_s:
            raise fault
        return float(seconds)


def passes(fault: ServiceError) -> bool:
    """Whether the same call may well succeed a while later."""
    match fault:
        case ProblemError(status=429):
            return True
        case ProblemError(status=503):
            return fault.retry_after is not None
        case AnswerMalformed():
            return fault.status in PROXY
        case _:
            return isinstance(fault, ConnectionFailed | TimedOut)
