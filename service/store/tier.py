"""What the tiers of the store have in common."""

from __future__ import annotations

from typing import Protocol

from service.requests import Upload
from service.store.address import Address
from service.store.tally import Tally


class Tier(Protocol):
    """A place where meshes are kept; what goes wrong in it is counted, never raised."""

    name: str
    tally: Tally

    def put(self, address: Address, upload: Upload) -> bool:
        """Keep a mesh; False when it can't be."""

    def get(self, address: Address) -> Upload | None:
        """The mesh, if it is there as it was stored."""
