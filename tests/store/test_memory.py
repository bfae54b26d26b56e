from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor

from hypothesis import given
from hypothesis import strategies as st

from service.requests import Upload
from service.store.address import Address
from service.store.memory import OVERHEAD, Memory


def mesh(content: bytes, name: str = "a.obj") -> Upload:
    return Upload(content, name, "model/obj")


def at(upload: Upload, owner: str = "") -> Address:
    return Address(upload.mesh_id, owner)


def test_a_mesh_is_kept_under_its_digest() -> None:
    memory = Memory(100 + OVERHEAD)
    assert memory.put(at(mesh(b"abc")), mesh(b"abc"))
    kept = memory.get(Address(f"sha256-{hashlib.sha256(b'abc').hexdigest()}", ""))
    assert kept is not None
    assert (kept.data, kept.name, kept.content_type) == (b"abc", "a.obj", "model/obj")
    assert memory.get(at(mesh(b"abc"), "somebody else")) is None
    assert (memory.tally.hits, memory.tally.misses, memory.entries) == (1, 1, 1)


def test_the_least_recently_used_goes_first() -> None:
    memory = Memory(2 * OVERHEAD + 10)
    a, b, c = mesh(b"aaaa"), mesh(b"bbbb"), mesh(b"cccc")
    memory.put(at(a), a)
    memory.put(at(b), b)
    memory.get(at(a))
    memory.put(at(c), c)
    assert memory.get(at(a)) is a
    assert memory.get(at(c)) is c
    assert memory.get(at(b)) is None
    assert memory.size == 2 * OVERHEAD + 8
    assert memory.tally.evictions == 1


def test_the_same_content_is_counted_once_and_takes_the_latest_name() -> None:
    memory = Memory(2 * OVERHEAD + 10)
    one, two = mesh(b"abcdef", "one.obj"), mesh(b"abcdef", "two.obj")
    memory.put(at(one), one)
    memory.put(at(two), two)
    assert memory.size == OVERHEAD + 6
    assert memory.get(at(one)) is two


def test_what_is_over_the_capacity_is_refused_and_displaces_nothing() -> None:
    memory = Memory(OVERHEAD + 5)
    small, large = mesh(b"abc"), mesh(b"abcdef")
    memory.put(at(small), small)
    assert not memory.put(at(large), large)
    assert memory.get(at(small)) is small


def test_no_capacity_keeps_nothing_at_all() -> None:
    memory = Memory(0)
    assert not memory.put(at(mesh(b"")), mesh(b""))
    assert memory.entries == 0


@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 3000))), st.integers(0, 9000))
def test_it_is_never_over_its_capacity(puts: list[tuple[int, int]], capacity: int) -> None:
    memory = Memory(capacity)
    for content, length in puts:
        upload = mesh(bytes([content]) * length)
        fits = length + OVERHEAD <= capacity
        assert memory.put(at(upload), upload) is fits
        assert memory.size <= capacity
        assert (memory.get(at(upload)) is upload) is fits


def test_many_threads_leave_the_count_right() -> None:
    memory = Memory(7 * (OVERHEAD + 7) + 1)
    meshes = [mesh(bytes([value]) * 7) for value in range(40)]
    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(lambda one: memory.put(at(one), one), meshes * 5))
    kept = [one for one in meshes if memory.get(at(one)) is not None]
    assert len(kept) == memory.entries == 7
    assert memory.size == 7 * (OVERHEAD + 7)
