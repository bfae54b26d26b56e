from __future__ import annotations

import logging
import sys
import threading
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from service.requests import Upload
from service.store import patience, shared
from service.store.address import Address
from service.store.fault import StoreFault
from service.store.shared import Shared

UPLOAD = Upload(bytes(range(256)), "стул.stl", "model/stl")
ADDRESS = Address(UPLOAD.mesh_id, "")


@pytest.fixture(params=["memory", "file"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    if request.param == "file":
        yield (tmp_path / "shared" / "meshes").as_uri()
    else:
        root = f"memory://{uuid.uuid4().hex}"
        yield f"{root}/meshes"
        fsspec.filesystem("memory").rm(root, recursive=True)


def paths(url: str) -> list[str]:
    files, root = fsspec.core.url_to_fs(url)
    return files.find(root)


def test_what_one_keeps_another_finds(url: str) -> None:
    one, two = Shared(url), Shared(url)
    assert two.get(ADDRESS) is None
    assert one.put(ADDRESS, UPLOAD)
    assert two.get(ADDRESS) == UPLOAD
    assert two.get(Address(UPLOAD.mesh_id, "somebody else")) is None
    assert (two.tally.hits, two.tally.misses) == (1, 2)
    assert len(paths(url)) == 1


def test_what_was_just_written_is_not_written_again(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Shared(url)
    store.put(ADDRESS, UPLOAD)
    (path,) = paths(url)
    files, _ = fsspec.core.url_to_fs(url)
    files.rm(path)
    assert store.put(ADDRESS, UPLOAD)
    assert paths(url) == []
    assert store.put(ADDRESS, Upload(UPLOAD.data, "other.stl", "model/stl"))
    monkeypatch.setattr(shared, "FRESH_S", 0.0)
    assert store.put(ADDRESS, UPLOAD)
    kept = Shared(url).get(ADDRESS)
    assert kept == UPLOAD


def test_only_so_many_are_remembered(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared, "REMEMBERED", 2)
    store = Shared(url)
    for number in range(5):
        upload = Upload(bytes([number]))
        store.put(Address(upload.mesh_id, ""), upload)
    assert len(store._written) == 2


def test_an_entry_that_is_not_whole_is_missing_and_left_alone(url: str) -> None:
    Shared(url).put(ADDRESS, UPLOAD)
    (path,) = paths(url)
    files, _ = fsspec.core.url_to_fs(url)
    files.pipe_file(path, files.cat_file(path)[:-1])
    store = Shared(url)
    assert store.get(ADDRESS) is None
    assert (store.tally.corrupted, store.tally.read_failures) == (1, 0)
    assert paths(url) == [path]
    assert store.put(ADDRESS, UPLOAD)
    assert store.get(ADDRESS) == UPLOAD


@pytest.mark.parametrize("error", [OSError("no route"), PermissionError(), RuntimeError("denied")])
def test_an_outage_is_counted_and_never_raises(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, error: Exception
) -> None:
    calls = []

    def fail(*_: Any, **__: Any) -> Any:
        calls.append(1)
        raise error

    store = Shared(f"memory://{uuid.uuid4().hex}")
    monkeypatch.setattr(MemoryFileSystem, "pipe_file", fail)
    monkeypatch.setattr(MemoryFileSystem, "cat_file", fail)
    with caplog.at_level(logging.WARNING):
        for _ in range(5):
            assert not store.put(ADDRESS, UPLOAD)
            assert store.get(ADDRESS) is None
    assert (store.tally.write_failures, store.tally.read_failures) == (5, 5)
    assert len(calls) == 1
    assert len([r for r in caplog.records if "shared store" in r.getMessage()]) == 1


def test_a_failed_write_to_a_folder_leaves_nothing_half_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Shared(tmp_path.as_uri())

    def fail(*_: Any, **__: Any) -> Any:
        raise OSError("disk full")

    monkeypatch.setattr(store._files, "mv", fail)
    assert not store.put(ADDRESS, UPLOAD)
    assert list(tmp_path.iterdir()) == []


def test_a_store_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    release = threading.Event()
    store = Shared(f"memory://{uuid.uuid4().hex}")
    store._patience = patience.Patience(0.1, 2, 60)
    monkeypatch.setattr(MemoryFileSystem, "cat_file", lambda *_, **__: release.wait(60))
    assert store.get(ADDRESS) is None
    assert store.tally.read_failures == 1
    release.set()


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("/srv/meshes", "no URL"),
        ("nowhere://a", "nowhere"),
        ("file:///dev/null/meshes", "Not a directory"),
    ],
)
def test_a_url_that_can_not_be_is_told_of(url: str, words: str) -> None:
    with pytest.raises(StoreFault, match=f"STORE_URL.*{words}"):
        Shared(url)


def test_a_password_in_the_url_is_not_told() -> None:
    with pytest.raises(StoreFault) as caught:
        Shared("nowhere://key:hunter2@bucket")
    assert "hunter2" not in str(caught.value)


def test_without_fsspec_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(StoreFault, match=r"shape-parameters\[shared\]"):
        Shared("memory://a")
