"""What the memory that the service may use is spent on."""

from __future__ import annotations

from dataclasses import dataclass

MEBIBYTE = 1024 * 1024

AT_REST_BYTES = 200 * MEBIBYTE
"""What the service takes without a request, as measured."""
VERTEX_BYTES = 944
"""What a worker takes for each vertex of a mesh, as measured."""
LEAST_VERTICES = 50_000
"""Meshes of so many are taken in any case."""


@dataclass(frozen=True)
class Budget:
    """So many `bytes` of memory, for all there is."""

    bytes: int

    def share(self, asked: int | None) -> int:
        """Bytes for one sort of things that are held: as many as the operator says, else an eighth
        of all, or less."""
        return min(256 * MEBIBYTE, self.bytes // 8) if asked is None else asked

    @property
    def jobs(self) -> int:
        """Bytes for jobs that no disk holds: a 64th of all, lest meshes lose their room to them."""
        return min(256 * MEBIBYTE, self.bytes // 64)

    def vertices(self, workers: int, held: int) -> int:
        """Of meshes that all workers can work on at once, beside so many bytes that are held."""
        room = self.bytes - AT_REST_BYTES - held
        return max(LEAST_VERTICES, room // (workers * VERTEX_BYTES))
