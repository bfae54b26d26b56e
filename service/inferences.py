"""What is known of uploads, kept so that requests that name or repeat one need not find it anew.

Entries are found by an upload's content, so that who sends or may read it knows all there is to
know: they are not told apart by client.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock

from service.encode.basemodel import Model
from service.footprint import footprint
from service.inference import Inference
from service.once import Flights
from service.template.affine import AffineTemplate
from service.template.skinned import SkinnedTemplate

MODELS = (Model, AffineTemplate, SkinnedTemplate)
"""What an inference refers to and does not hold alone."""


@dataclass(frozen=True)
class _Entry:
    """An inference, the bytes that it takes, and how many parts it had when they were counted."""

    found: Inference
    size: int
    parts: int


class Inferences:
    """A cache bounded in bytes; what was not used for longest goes first.

    An inference grows as edits ask for more of it: it is measured again after each use.  Safe to
    use from several threads, which share what they are given: it never changes but by that.

    Attributes:
        capacity, size: bytes that entries may take, and that they take.
        hits, misses: requests whose inference was there or being made, and those that made one.
    """

    def __init__(self, capacity: int) -> None:
        """`capacity` is in bytes of memory."""
        self.capacity = capacity
        self.size = 0
        self.hits = self.misses = 0
        self._entries: OrderedDict[Hashable, _Entry] = OrderedDict()
        self._lock = Lock()
        self._flights = Flights()

    def __len__(self) -> int:
        return len(self._entries)

    @contextmanager
    def held(self, key: Hashable, infer: Callable[[], Inference]) -> Iterator[Inference]:
        """The inference of a key, for the length of the block; `infer` makes one that is not kept.

        Requests for one that is just being made wait for it.
        """

        made = False

        def keep() -> Inference:
            nonlocal made
            made = True
            found = infer()
            self._settle(key, found)
            return found

        found = self._flights.join(key, lambda: self._look(key), keep)
        self._count(hit=not made)
        try:
            yield found
        finally:
            self._settle(key, found)

    def retain(self, models: Iterable[Model]) -> None:
        """Forget what others than these models have found: they are served no more."""
        served = set(models)
        with self._lock:
            for key, entry in list(self._entries.items()):
                if not served.issuperset(c.model for c in entry.found.candidates):
                    del self._entries[key]
                    self.size -= entry.size

    def _look(self, key: Hashable) -> Inference | None:
        with self._lock:
            entry = self._entries.get(key)
            if entry is None:
                return None
            self._entries.move_to_end(key)
            return entry.found

    def _count(self, hit: bool) -> None:
        with self._lock:
            self.hits += hit
            self.misses += not hit

    def _settle(self, key: Hashable, found: Inference) -> None:
        """Put what an inference has become into the account, and forget what is too much."""
        parts = found.parts
        with self._lock:
            known = self._entries.get(key)
        if known is not None and known.found is found and known.parts == parts:
            return
        entry = _Entry(found, footprint(found, MODELS), parts)
        with self._lock:
            if (before := self._entries.pop(key, None)) is not None:
                self.size -= before.size
            if entry.size > self.capacity:
                return
            self._entries[key] = entry
            self.size += entry.size
            while self.size > self.capacity:
                self.size -= self._entries.popitem(last=False)[1].size
