"""What several requests ask for at the same time is made by one of them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from threading import Event, Lock
from typing import Any, TypeVar

from service import deadline
from service.stages import stage

T = TypeVar("T")

POLL_S = 0.05
"""How often one who waits looks whether it is still worth it."""


@dataclass
class _Making:
    """A value that a thread is making; without one at the end, it could not."""

    done: Event = field(default_factory=Event)
    value: Any = None


class Flights:
    """Makes each value once, however many threads ask for it meanwhile.

    Values are not kept beyond those calls; None is no value.
    """

    def __init__(self) -> None:
        self._making: dict[Hashable, _Making] = {}
        self._lock = Lock()

    def join(self, key: Hashable, look: Callable[[], T | None], make: Callable[[], T]) -> T:
        """What `look` finds, else what `make` makes here or in another thread that began before.

        Who waits does so within its own deadline.  When the other fails, for a reason that may be
        its own, it makes the value itself.

        Args:
            key: of the value.
            look: where values are kept; `make` is to keep them there.
        """
        while True:
            with self._lock:
                if (found := look()) is not None:
                    return found
                if (making := self._making.get(key)) is None:
                    mine = self._making[key] = _Making()
                    break
            with stage("queue"):
                while not making.done.wait(POLL_S):
                    deadline.check()
            if making.value is not None:
                value: T = making.value
                return value
        try:
            mine.value = made = make()
            return made
        finally:
            with self._lock:
                del self._making[key]
            mine.done.set()


class Memo:
    """Values by key, each made when it is first asked for, and kept."""

    def __init__(self) -> None:
        self._values: dict[Hashable, Any] = {}
        self._flights = Flights()

    def __len__(self) -> int:
        return len(self._values)

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """The value of a key; threads that ask for it meanwhile wait, as in `Flights.join`."""

        def keep() -> T:
            made = self._values[key] = make()
            return made

        return self._flights.join(key, lambda: self._values.get(key), keep)
