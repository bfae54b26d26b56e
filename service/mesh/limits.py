"""How much a file may unfold into, whatever its size: a few bytes can claim a billion vertices.

An interface with less memory than that takes sets a lower limit by `at_most`; it travels in a
context variable, as the deadline does, and for the same reason.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

from service.errors import TooLarge
from service.mesh.faults import too_many

VERTICES = 2_000_000
FACES = 4_000_000
# Faces that go with so many vertices.
FACES_PER_VERTEX = 2
# Nodes of a glTF scene, primitives that they show, chunks of a GLB: each costs some time by itself.
PARTS = 20_000
# Values in a JSON text, each some hundred bytes when parsed.
VALUES = 1_000_000
# Lines and tokens of a text, each some hundred bytes while they are sorted out.
LINES = 16_000_000
TOKENS = 32_000_000
# Members of an archive, and bytes that all of them inflate to.
MEMBERS = 2_000
INFLATED = 256 << 20
# Meshes and their buffers shrink tenfold at best; small archives may be anything.
RATIO = 200
SMALL = 16 << 20


_affordable: ContextVar[int | None] = ContextVar("vertices", default=None)


@contextmanager
def at_most(vertices: int) -> Iterator[None]:
    """Let meshes within the block have so many vertices, and as many faces as go with them."""
    token = _affordable.set(vertices)
    try:
        yield
    finally:
        _affordable.reset(token)


def most_vertices() -> int:
    """How many vertices a mesh may have here."""
    affordable = _affordable.get()
    return VERTICES if affordable is None else min(VERTICES, affordable)


def check_vertices(count: int) -> None:
    """Raise TooLarge when `count` vertices are too many."""
    limit = most_vertices()
    if count > limit:
        raise too_many("vertices", count, limit)


def check_faces(count: int) -> None:
    """Raise TooLarge when `count` triangles are too many."""
    limit = min(FACES, FACES_PER_VERTEX * most_vertices())
    if count > limit:
        raise too_many("faces", count, limit)


def check_parts(count: int) -> None:
    """Raise TooLarge when `count` nodes or primitives are too many."""
    if count > PARTS:
        raise too_many("parts", count, PARTS)


def check_json(text: bytes) -> None:
    """Raise TooLarge when a JSON `text` holds too many values; its strings may be of any length."""
    count = sum(map(text.count, (b",", b"[", b"{")))
    if count > VALUES:
        raise too_many("json_values", count, VALUES)


def check_lines(count: int) -> None:
    """Raise TooLarge when a text of `count` lines has too many."""
    if count > LINES:
        raise too_many("lines", count, LINES)


def check_tokens(count: int) -> None:
    """Raise TooLarge when a text of `count` tokens has too many."""
    if count > TOKENS:
        raise too_many("tokens", count, TOKENS)


def check_members(count: int) -> None:
    """Raise TooLarge when an archive of `count` members has too many."""
    if count > MEMBERS:
        raise _archive_too_large(f"has {count} members; the limit is {MEMBERS}")


def check_inflated(packed: int, sizes: Sequence[int]) -> None:
    """Raise TooLarge when members of `sizes` bytes are too much, or too much for `packed` bytes."""
    total = sum(sizes)
    if total > INFLATED:
        raise _archive_too_large(f"unpacks to {total} bytes; the limit is {INFLATED}")
    if total > SMALL and total > RATIO * packed:
        raise _archive_too_large(
            f"unpacks to {total // max(packed, 1)} times its size; the limit is {RATIO}"
        )


def _archive_too_large(detail: str) -> TooLarge:
    return TooLarge(
        "archive_too_large",
        f"The archive {detail}.",
        "Zip only the mesh with its materials, buffers and textures.",
    )
