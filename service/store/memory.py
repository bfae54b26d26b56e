"""Kept meshes in memory."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock

from service.requests import Upload
from service.store.address import Address
from service.store.tally import Tally

OVERHEAD = 1024
"""Bytes that a mesh is counted with beside its file, so that many small ones are bounded too."""


class Memory:
    """A tier bounded in bytes; the least recently used goes first.

    Safe to use from several threads, and quick enough for the event loop.

    Attributes:
        size, capacity: bytes held and allowed.
        tally: what happened so far.
    """

    name = "memory"

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.size = 0
        self.tally = Tally()
        self._meshes: OrderedDict[Address, Upload] = OrderedDict()
        self._lock = Lock()

    @property
    def entries(self) -> int:
        """How many meshes are held."""
        return len(self._meshes)

    def put(self, address: Address, upload: Upload) -> bool:
        """Keep a mesh; False when it alone is over the capacity."""
        if _cost(upload) > self.capacity:
            return False
        with self._lock:
            self._forget(address)
            self._meshes[address] = upload
            self.size += _cost(upload)
            while self.size > self.capacity:
                self._forget(next(iter(self._meshes)))
                self.tally.add("evictions")
        return True

    def get(self, address: Address) -> Upload | None:
        """The mesh, which is now the most recently used."""
        with self._lock:
            upload = self._meshes.get(address)
            if upload is not None:
                self._meshes.move_to_end(address)
        self.tally.add("misses" if upload is None else "hits")
        return upload

    def _forget(self, address: Address) -> None:
        if (upload := self._meshes.pop(address, None)) is not None:
            self.size -= _cost(upload)


def _cost(upload: Upload) -> int:
    return len(upload.data) + OVERHEAD
