"""What a tier of the store counts, and how it complains."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field
from threading import Lock
from typing import Literal

SELDOM_S = 60.0
"""Least time between two complaints of one tier."""

Event = Literal["hits", "misses", "evictions", "corrupted", "read_failures", "write_failures"]

logger = logging.getLogger(__name__)


@dataclass
class Tally:
    """Counts of one tier since the process started; `/metrics` reads them as they are.

    Attributes:
        hits, misses: of lookups.
        evictions: entries that made room for others.
        corrupted: entries that were not what had been stored.
        read_failures, write_failures: of the disk or the network.
    """

    hits: int = 0
    misses: int = 0
    evictions: int = 0
    corrupted: int = 0
    read_failures: int = 0
    write_failures: int = 0
    _lock: Lock = field(default_factory=Lock, repr=False, compare=False)

    def add(self, event: Event) -> None:
        """Count one; from any thread."""
        with self._lock:
            setattr(self, event, getattr(self, event) + 1)


class Complaints:
    """Warnings of one tier, once a minute at most: a full disk fails every request."""

    def __init__(self, tier: str) -> None:
        self._tier = tier
        self._lock = Lock()
        self._next = -float("inf")
        self._unsaid = 0

    def say(self, what: str, error: BaseException | None = None) -> None:
        """Log it, or count it for the next time."""
        now = time.monotonic()
        with self._lock:
            if now < self._next:
                self._unsaid += 1
                return
            unsaid, self._unsaid, self._next = self._unsaid, 0, now + SELDOM_S
        more = f" ({unsaid} more since the last time)" if unsaid else ""
        reason = "" if error is None else f": {type(error).__name__}: {error}"
        logger.warning("the %s store %s%s%s", self._tier, what, reason, more)
