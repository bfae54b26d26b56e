from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor

import pytest

from service.api.store import MeshStore
from service.errors import NotFound
from service.requests import Upload


def mesh(content: bytes, name: str = "a.obj") -> Upload:
    return Upload(content, name, "model/obj")


def test_a_mesh_is_kept_under_its_digest() -> None:
    store = MeshStore(100)
    assert store.put(mesh(b"abc"))
    kept = store.get(f"sha256-{hashlib.sha256(b'abc').hexdigest()}")
    assert (kept.data, kept.name, kept.content_type) == (b"abc", "a.obj", "model/obj")


def test_an_unknown_id_says_to_send_the_file_again() -> None:
    with pytest.raises(NotFound) as caught:
        MeshStore(100).get("sha256-0")
    assert caught.value.code == "mesh_id_unknown"
    assert "again" in caught.value.suggestion


def test_the_least_recently_used_goes_first() -> None:
    store = MeshStore(10)
    a, b, c = mesh(b"aaaa"), mesh(b"bbbb"), mesh(b"cccc")
    store.put(a)
    store.put(b)
    store.get(a.mesh_id)
    store.put(c)
    assert store.get(a.mesh_id) is a
    assert store.get(c.mesh_id) is c
    with pytest.raises(NotFound):
        store.get(b.mesh_id)
    assert store.size == 8


def test_the_same_content_is_counted_once_and_takes_the_latest_name() -> None:
    store = MeshStore(10)
    store.put(mesh(b"abcdef", "one.obj"))
    store.put(mesh(b"abcdef", "two.obj"))
    assert store.size == 6
    assert store.get(mesh(b"abcdef").mesh_id).name == "two.obj"


def test_what_is_over_the_capacity_is_refused_and_displaces_nothing() -> None:
    store = MeshStore(5)
    small = mesh(b"abc")
    store.put(small)
    assert not store.put(mesh(b"abcdef"))
    assert store.get(small.mesh_id) is small


def test_many_threads_leave_the_count_right() -> None:
    store = MeshStore(50)
    meshes = [mesh(bytes([value]) * 7) for value in range(40)]
    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(store.put, meshes * 5))
    held = 0
    for one in meshes:
        try:
            held += len(store.get(one.mesh_id).data)
        except NotFound:
            continue
    assert store.size == held == 49
