from __future__ import annotations

import sys
import uuid
from pathlib import Path

import anyio
import pytest

from service.errors import NotFound
from service.requests import Upload
from service.store.address import Address
from service.store.disk import Disk
from service.store.memory import OVERHEAD
from service.store.meshstore import Kept, MeshStore, open_store
from service.store.shared import Shared

MIB = 1 << 20
UPLOAD = Upload(b"abc", "a.obj", "model/obj")


def unknown(store: MeshStore, mesh_id: str, owner: str = "") -> None:
    with pytest.raises(NotFound) as caught:
        store.get(mesh_id, owner)
    assert caught.value.code == "mesh_id_unknown"
    assert "again" in caught.value.suggestion
    with pytest.raises(NotFound):
        anyio.run(store.fetch, mesh_id, owner)


@pytest.fixture
def bucket() -> str:
    return f"memory://{uuid.uuid4().hex}"


@pytest.fixture(params=["memory", "disk", "shared", "all"])
def store(request: pytest.FixtureRequest, tmp_path: Path, bucket: str) -> MeshStore:
    """A store of some tiers; where there are others, none of it fits into memory."""
    kind = request.param
    disk = tmp_path if kind in ("disk", "all") else None
    url = bucket if kind in ("shared", "all") else None
    return open_store(MIB if kind == "memory" else 0, disk, MIB, url)


def test_a_mesh_is_its_owners_alone(store: MeshStore) -> None:
    unknown(store, UPLOAD.mesh_id)
    assert store.put(UPLOAD, "acme") is Kept.FULLY
    assert store.get(UPLOAD.mesh_id, "acme") == UPLOAD
    assert anyio.run(store.fetch, UPLOAD.mesh_id, "acme") == UPLOAD
    for owner in ("", "Acme", "acme ", "other"):
        unknown(store, UPLOAD.mesh_id, owner)
    own = Upload(UPLOAD.data, "mine.obj", None)
    store.put(own, "other")
    assert store.get(UPLOAD.mesh_id, "other") == own
    assert store.get(UPLOAD.mesh_id, "acme") == UPLOAD


@pytest.mark.parametrize(
    "mesh_id", ["", "../..", "sha256-0", "x" * 100_000, "sha256-/../" + "0" * 60]
)
def test_what_is_no_id_is_unknown(store: MeshStore, mesh_id: str) -> None:
    unknown(store, mesh_id)


def test_found_further_down_it_moves_up(tmp_path: Path, bucket: str) -> None:
    open_store(0, None, MIB, bucket).put(UPLOAD)
    store = open_store(MIB, tmp_path, MIB, bucket)
    assert store.disk is not None
    assert store.shared is not None
    assert store.get(UPLOAD.mesh_id) == UPLOAD
    assert (store.memory.entries, store.disk.entries) == (1, 1)
    assert store.get(UPLOAD.mesh_id) is store.get(UPLOAD.mesh_id)
    assert store.shared.tally.hits == 1
    assert store.memory.tally.hits == 2


def test_what_is_used_from_memory_stays_on_the_disk(tmp_path: Path) -> None:
    store = MeshStore(MIB, Disk(tmp_path, 2 * 4096))
    meshes = [Upload(bytes([number])) for number in range(3)]
    store.put(meshes[0])
    store.put(meshes[1])
    store.get(meshes[0].mesh_id)
    store.put(meshes[2])
    assert store.disk is not None
    kept = [store.disk.get(Address(mesh.mesh_id, "")) is not None for mesh in meshes]
    assert kept == [True, False, True]


@pytest.mark.parametrize(
    ("memory", "disk", "shared", "kept"),
    [
        (True, None, None, Kept.FULLY),
        (False, None, None, Kept.NOT),
        (True, True, None, Kept.FULLY),
        (False, True, None, Kept.FULLY),
        (True, False, None, Kept.BRIEFLY),
        (False, False, None, Kept.NOT),
        (True, True, True, Kept.FULLY),
        (True, False, True, Kept.FULLY),
        (True, True, False, Kept.HERE),
        (False, True, False, Kept.HERE),
        (True, False, False, Kept.BRIEFLY),
        (False, False, False, Kept.NOT),
        (True, None, True, Kept.FULLY),
        (True, None, False, Kept.BRIEFLY),
    ],
)
def test_how_well_a_mesh_is_kept(
    tmp_path: Path,
    bucket: str,
    monkeypatch: pytest.MonkeyPatch,
    memory: bool,
    disk: bool | None,
    shared: bool | None,
    kept: Kept,
) -> None:
    store = open_store(
        OVERHEAD + 3 if memory else OVERHEAD,
        None if disk is None else tmp_path,
        MIB,
        None if shared is None else bucket,
    )
    monkeypatch.setattr(Disk, "put", lambda *_: disk)
    monkeypatch.setattr(Shared, "put", lambda *_: shared)
    assert store.put(UPLOAD) is kept


def test_it_is_known_when_nothing_is_to_be_kept(tmp_path: Path, bucket: str) -> None:
    assert open_store(0, None, MIB, None).keeps_nothing
    assert not open_store(1, None, MIB, None).keeps_nothing
    assert not open_store(0, tmp_path, MIB, None).keeps_nothing
    assert not open_store(0, None, MIB, bucket).keeps_nothing


def test_what_is_not_set_is_not_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("fsspec", "service.store.disk", "service.store.shared"):
        monkeypatch.setitem(sys.modules, name, None)
    store = open_store(MIB, None, MIB, None)
    assert store.put(UPLOAD) is Kept.FULLY
    store.close()
