"""Meshes kept in memory, so that a request can name one instead of sending it again."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock

from service.errors import NotFound
from service.requests import Upload


class MeshStore:
    """A content-addressed cache, bounded in bytes; the least recently used mesh goes first.

    Safe to use from several threads.
    """

    def __init__(self, capacity: int) -> None:
        """`capacity` is in bytes of mesh files."""
        self.capacity = capacity
        self.size = 0
        self._meshes: OrderedDict[str, Upload] = OrderedDict()
        self._lock = Lock()

    def put(self, upload: Upload) -> bool:
        """Keep a mesh under its `mesh_id`; False when it alone is over the capacity."""
        mesh_id = upload.mesh_id
        if len(upload.data) > self.capacity:
            return False
        with self._lock:
            self._forget(mesh_id)
            self._meshes[mesh_id] = upload
            self.size += len(upload.data)
            while self.size > self.capacity:
                self._forget(next(iter(self._meshes)))
        return True

    def get(self, mesh_id: str) -> Upload:
        """The mesh of that id; NotFound (`mesh_id_unknown`) when it never came or is gone."""
        with self._lock:
            upload = self._meshes.get(mesh_id)
            if upload is not None:
                self._meshes.move_to_end(mesh_id)
                return upload
        raise NotFound(
            "mesh_id_unknown",
            f"No mesh is kept under the id {mesh_id[:80]!r}.",
            "Send the file again, as the part `mesh`; the cache is bounded and is lost on restart.",
        )

    def _forget(self, mesh_id: str) -> None:
        if (upload := self._meshes.pop(mesh_id, None)) is not None:
            self.size -= len(upload.data)
