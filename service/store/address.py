"""What a kept mesh is called: its content and whose it is."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass

_MESH_ID = re.compile("sha256-[0-9a-f]{64}")


@dataclass(frozen=True)
class Address:
    """The content ``sha256-<hex>`` of a mesh, and the owner who stored it.

    Two owners of the same content have an address each: an id is no proof of having the file.
    """

    mesh_id: str
    owner: str

    @classmethod
    def of(cls, mesh_id: str, owner: str) -> Address | None:
        """None for what can be no id, whatever a client made it of."""
        return cls(mesh_id, owner) if _MESH_ID.fullmatch(mesh_id) else None

    @property
    def name(self) -> str:
        """64 hex digits for a file's name, which tell neither the owner nor the content."""
        return hashlib.sha256(json.dumps([self.owner, self.mesh_id]).encode()).hexdigest()
