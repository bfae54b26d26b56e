"""How much a file may unfold into, whatever its size: a few bytes can claim a billion vertices."""

from __future__ import annotations

from service.mesh.faults import too_many

VERTICES = 2_000_000
FACES = 4_000_000
# Nodes of a glTF scene, and primitives that they show: each costs some time by itself.
PARTS = 20_000


def check_vertices(count: int) -> None:
    """Raise TooLarge when `count` vertices are too many."""
    if count > VERTICES:
        raise too_many("vertices", count, VERTICES)


def check_faces(count: int) -> None:
    """Raise TooLarge when `count` triangles are too many."""
    if count > FACES:
        raise too_many("faces", count, FACES)


def check_parts(count: int) -> None:
    """Raise TooLarge when `count` nodes or primitives are too many."""
    if count > PARTS:
        raise too_many("parts", count, PARTS)
