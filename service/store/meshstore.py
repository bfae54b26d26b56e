"""Meshes that were sent or made, kept so that a request can name one instead of sending it."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from anyio import CapacityLimiter, to_thread

from service.errors import NotFound
from service.requests import Upload
from service.store.address import Address
from service.store.memory import Memory
from service.store.tier import Tier

if TYPE_CHECKING:
    from service.store.disk import Disk
    from service.store.shared import Shared

READS_AT_ONCE = 4
"""Meshes that are read from the disk or the network at one time: each may be large."""


class Kept(Enum):
    """How well a mesh is kept."""

    FULLY = "in every tier that promises it"
    HERE = "on this machine's disk, but not where other replicas find it"
    BRIEFLY = "in memory only, though it should be safer"
    NOT = "not at all"


class MeshStore:
    """A content-addressed store in tiers: memory, and what is set of a disk and a shared store.

    A mesh goes to every tier at once and is looked for in that order; found further down, it moves
    up.  What one owner stores is unknown to every other.  No failure of a tier is ever raised.

    Safe to use from several threads.  `/metrics` reads, of each of `tiers`: its `name`, its `tally`
    (hits, misses, evictions, corrupted, read_failures, write_failures), and of memory and disk
    `size` and `capacity` in bytes and `entries`.

    Attributes:
        memory: the tier that is always there; of no capacity when nothing is to be kept.
        disk, shared: those that are set.
    """

    def __init__(
        self, capacity: int, disk: Disk | None = None, shared: Shared | None = None
    ) -> None:
        """`capacity` is of the memory, in bytes."""
        self.memory = Memory(capacity)
        self.disk = disk
        self.shared = shared
        self._reads = CapacityLimiter(READS_AT_ONCE)

    @property
    def tiers(self) -> Sequence[Tier]:
        """All that there are, the nearest first."""
        return [self.memory, *self._durable]

    @property
    def _durable(self) -> list[Disk | Shared]:
        return [tier for tier in (self.disk, self.shared) if tier is not None]

    @property
    def keeps_nothing(self) -> bool:
        """Whether no mesh is to be kept anywhere."""
        return self.memory.capacity == 0 and not self._durable

    def put(self, upload: Upload, owner: str = "") -> Kept:
        """Keep a mesh of an owner under its `mesh_id`; it waits for the disk and the network."""
        address = Address(upload.mesh_id, owner)
        remembered = self.memory.put(address, upload)
        on_disk = self.disk is not None and self.disk.put(address, upload)
        shared = self.shared is not None and self.shared.put(address, upload)
        if shared or (on_disk and self.shared is None) or (remembered and not self._durable):
            return Kept.FULLY
        if on_disk:
            return Kept.HERE
        return Kept.BRIEFLY if remembered else Kept.NOT

    def get(self, mesh_id: str, owner: str = "") -> Upload:
        """The mesh of that id; it waits for the disk and the network.

        Raises:
            NotFound: ``mesh_id_unknown``, when it never came from this owner, or is gone.
        """
        address = Address.of(mesh_id, owner)
        upload = None if address is None else self._remembered(address) or self._fetched(address)
        if upload is None:
            raise _unknown(mesh_id)
        return upload

    async def fetch(self, mesh_id: str, owner: str = "") -> Upload:
        """As `get`, for the event loop: at once from memory, else by a thread."""
        address = Address.of(mesh_id, owner)
        upload = None if address is None else self._remembered(address)
        if address is not None and upload is None and self._durable:
            upload = await to_thread.run_sync(self._fetched, address, limiter=self._reads)
        if upload is None:
            raise _unknown(mesh_id)
        return upload

    def close(self) -> None:
        """Let go of what the tiers hold; what is kept stays."""
        for tier in self._durable:
            tier.close()

    def _remembered(self, address: Address) -> Upload | None:
        upload = self.memory.get(address)
        if upload is not None and self.disk is not None:
            self.disk.touch(address)
        return upload

    def _fetched(self, address: Address) -> Upload | None:
        """From the disk or the shared store, into the tiers above."""
        above: list[Tier] = []
        for tier in self._durable:
            upload = tier.get(address)
            if upload is not None:
                self.memory.put(address, upload)
                for missed in above:
                    missed.put(address, upload)
                return upload
            above.append(tier)
        return None


def open_store(
    memory_bytes: int, directory: Path | None, disk_bytes: int, url: str | None
) -> MeshStore:
    """The store of the settings; what it is not set to use is not even imported.

    Raises:
        StoreFault: when a folder or URL can't be used at all.
    """
    disk, shared = None, None
    if directory is not None:
        from service.store.disk import Disk

        disk = Disk(directory, disk_bytes)
    if url is not None:
        from service.store.shared import Shared

        shared = Shared(url)
    return MeshStore(memory_bytes, disk, shared)


def _unknown(mesh_id: str) -> NotFound:
    return NotFound(
        "mesh_id_unknown",
        f"No mesh is kept under the id {mesh_id[:80]!r}.",
        "Send the file again, as the part `mesh`: meshes are kept for a while only.",
    )
