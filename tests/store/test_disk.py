from __future__ import annotations

import errno
import logging
import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.requests import Upload
from service.store.address import Address
from service.store.disk import BLOCK, Disk
from service.store.fault import StoreFault

AMPLE = 1 << 30


def mesh(content: bytes, name: str = "a.obj") -> Upload:
    return Upload(content, name, "model/obj")


def numbered(number: int, length: int = 10) -> Upload:
    return mesh(number.to_bytes(4, "big") * (length // 4))


def at(upload: Upload, owner: str = "") -> Address:
    return Address(upload.mesh_id, owner)


def files(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.name != ".lock"]


def put(disk: Disk, upload: Upload) -> bool:
    return disk.put(at(upload), upload)


def get(disk: Disk, upload: Upload) -> Upload | None:
    return disk.get(at(upload))


def test_a_mesh_is_found_again_after_a_restart(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "store"
    disk = Disk(folder, AMPLE)
    upload = Upload(bytes(range(256)) * 999, "стул.stl", "model/stl")
    assert put(disk, upload)
    assert get(disk, upload) == upload
    disk.close()
    again = Disk(folder, AMPLE)
    assert get(again, upload) == upload
    assert (again.entries, again.size) == (1, disk.size)
    assert again.get(at(upload, "somebody else")) is None
    assert (again.tally.hits, again.tally.misses) == (1, 1)
    (file,) = files(folder)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert not {upload.mesh_id[7:], "стул"} & set(file.name.split("."))


def test_the_least_recently_used_goes_first_after_a_restart_as_well(tmp_path: Path) -> None:
    disk = Disk(tmp_path, 3 * BLOCK)
    a, b, c, d, e, f = (numbered(number) for number in range(6))
    for age, upload in enumerate((a, b, c)):
        put(disk, upload)
        os.utime(tmp_path / f"{at(upload).name}.mesh", (age, age))
    assert get(disk, a) == a
    disk.touch(at(b))
    put(disk, d)
    assert get(disk, c) is None
    assert disk.tally.evictions == 1
    disk.close()

    again = Disk(tmp_path, 3 * BLOCK)
    put(again, e)  # b was touched in memory alone
    assert get(again, b) is None
    put(again, f)
    assert get(again, a) is None
    assert [get(again, kept) for kept in (d, e, f)] == [d, e, f]


def test_a_smaller_budget_holds_from_the_start(tmp_path: Path) -> None:
    disk = Disk(tmp_path, AMPLE)
    for number in range(5):
        put(disk, numbered(number))
    disk.close()
    again = Disk(tmp_path, 2 * BLOCK)
    assert (again.size, again.entries, len(files(tmp_path))) == (2 * BLOCK, 2, 2)


def test_the_same_content_is_written_once_and_takes_the_latest_name(tmp_path: Path) -> None:
    disk = Disk(tmp_path, AMPLE)
    put(disk, mesh(b"abc", "one.obj"))
    (file,) = files(tmp_path)
    written = file.stat().st_ino
    put(disk, mesh(b"abc", "one.obj"))
    assert file.stat().st_ino == written
    put(disk, mesh(b"abc", "two.stl"))
    kept = get(disk, mesh(b"abc"))
    assert kept is not None
    assert kept.name == "two.stl"
    assert (disk.entries, disk.size) == (1, BLOCK)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 9), st.integers(0, 5 * BLOCK)), max_size=20),
    st.integers(0, 10 * BLOCK),
)
def test_it_is_never_over_its_capacity(puts: list[tuple[int, int]], capacity: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        disk = Disk(folder, capacity)
        for content, length in puts:
            upload = mesh(bytes([content]) * length)
            kept = put(disk, upload)
            taken = sum(-(-file.stat().st_size // BLOCK) * BLOCK for file in files(folder))
            assert disk.size == taken <= capacity
            assert disk.entries == len(files(folder))
            assert (get(disk, upload) == upload) is kept
        disk.close()
        again = Disk(folder, capacity)
        assert (again.size, again.entries) == (disk.size, disk.entries)
        again.close()


def test_many_threads_share_it(tmp_path: Path) -> None:
    capacity = 12 * BLOCK
    disk = Disk(tmp_path, capacity)
    meshes = [numbered(number, 1 + number * 700) for number in range(20)]
    over = []

    def work(seed: int) -> None:
        random = Random(seed)
        for _ in range(60):
            upload = random.choice(meshes)
            if random.random() < 0.5:
                put(disk, upload)
            else:
                assert get(disk, upload) in (None, upload)
            over.append(disk.size > capacity)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(8)))
    assert not any(over)
    assert disk.tally.corrupted == disk.tally.read_failures == disk.tally.write_failures == 0
    assert disk.tally.evictions > 0
    taken = sum(-(-file.stat().st_size // BLOCK) * BLOCK for file in files(tmp_path))
    assert disk.size == taken
    assert disk.entries == len(files(tmp_path))


@pytest.mark.parametrize(
    "damage", [lambda data: data[:-1], lambda data: data[:-1] + b"\0", lambda data: b""]
)
def test_a_damaged_entry_is_dropped_and_can_be_stored_anew(tmp_path: Path, damage: object) -> None:
    disk = Disk(tmp_path, AMPLE)
    upload = mesh(b"abcdef")
    put(disk, upload)
    (file,) = files(tmp_path)
    assert callable(damage)
    file.write_bytes(damage(file.read_bytes()))
    assert get(disk, upload) is None
    assert (disk.tally.corrupted, disk.entries, disk.size) == (1, 0, 0)
    assert files(tmp_path) == []
    assert put(disk, upload)
    assert get(disk, upload) == upload


def test_a_truncated_entry_is_written_anew_when_it_is_put_again(tmp_path: Path) -> None:
    disk = Disk(tmp_path, AMPLE)
    upload = mesh(b"abcdef")
    put(disk, upload)
    (file,) = files(tmp_path)
    file.write_bytes(file.read_bytes()[:-1])
    assert put(disk, upload)
    assert get(disk, upload) == upload


def test_an_entry_that_somebody_deleted_is_written_anew(tmp_path: Path) -> None:
    disk = Disk(tmp_path, AMPLE)
    upload = mesh(b"abcdef")
    put(disk, upload)
    files(tmp_path)[0].unlink()
    assert put(disk, upload)
    assert get(disk, upload) == upload
    assert disk.size == BLOCK


def test_what_was_left_half_written_is_swept_and_nothing_else(tmp_path: Path) -> None:
    disk = Disk(tmp_path, AMPLE)
    put(disk, mesh(b"abc"))
    partial = tmp_path / f"{'0' * 64}.{'1' * 16}.partial"
    theirs = tmp_path / "notes.txt"
    for file in (partial, theirs):
        file.write_bytes(b"x")
    # Another process is at work there: it may be writing that very file.
    other = Disk(tmp_path, AMPLE)
    assert partial.exists()
    disk.close()
    other.close()
    alone = Disk(tmp_path, AMPLE)
    assert not partial.exists()
    assert theirs.exists()
    assert alone.entries == 1


def test_two_processes_find_what_either_keeps(tmp_path: Path) -> None:
    one, two = Disk(tmp_path, AMPLE), Disk(tmp_path, AMPLE)
    put(one, mesh(b"abc"))
    assert get(two, mesh(b"abc")) == mesh(b"abc")


@pytest.mark.parametrize("call", ["fsync", "replace", "open", "utime"])
@pytest.mark.parametrize("fault", [errno.ENOSPC, errno.EROFS, errno.EIO])
def test_a_disk_that_fails_is_counted_and_never_raises(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    call: str,
    fault: int,
) -> None:
    disk = Disk(tmp_path, AMPLE)
    kept = mesh(b"abc")
    put(disk, kept)

    def fail(*_: object, **__: object) -> None:
        raise OSError(fault, os.strerror(fault))

    with monkeypatch.context() as patch:
        patch.setattr(os, call, fail)
        with caplog.at_level(logging.WARNING):
            for number in range(5):
                assert put(disk, numbered(number)) is (call == "utime")
        assert get(disk, kept) == kept
    failed = 0 if call == "utime" else 5
    assert disk.tally.write_failures == failed
    assert len([r for r in caplog.records if "disk store" in r.getMessage()]) == min(failed, 1)
    assert len(files(tmp_path)) == disk.entries == 6 - failed
    assert disk.size == disk.entries * BLOCK
    assert put(disk, numbered(9))


def test_the_file_is_synced_before_it_is_renamed_and_the_folder_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Disk(tmp_path, AMPLE)
    steps = []
    sync, replace = os.fsync, os.replace

    def synced(descriptor: int) -> None:
        facts = os.fstat(descriptor)
        steps.append("folder" if stat.S_ISDIR(facts.st_mode) else facts.st_size)
        sync(descriptor)

    def renamed(source: Path, target: Path) -> None:
        steps.append("rename")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", renamed)
    put(disk, mesh(b"abc"))
    assert steps == [files(tmp_path)[0].stat().st_size, "rename", "folder"]


def test_a_failed_sync_of_the_folder_promises_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Disk(tmp_path, AMPLE)
    true = os.fsync

    def fail(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(errno.EIO, "no")
        true(descriptor)

    monkeypatch.setattr(os, "fsync", fail)
    assert not put(disk, mesh(b"abc"))
    assert (disk.size, disk.entries, files(tmp_path)) == (0, 0, [])


def test_what_is_being_written_is_not_deleted_to_make_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Disk(tmp_path, 2 * BLOCK)
    old, new, other = mesh(b"abc", "old.obj"), mesh(b"abc", "new.obj"), mesh(b"other")
    put(disk, old)
    true = os.replace

    def replace(source: Path, target: Path) -> None:
        true(source, target)
        monkeypatch.setattr(os, "replace", true)
        assert not put(disk, other)

    monkeypatch.setattr(os, "replace", replace)
    assert put(disk, new)
    assert get(disk, new) == new
    assert put(disk, other)
    assert (disk.size, disk.entries) == (2 * BLOCK, 2)


def test_what_can_not_be_read_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = Disk(tmp_path, AMPLE)
    upload = mesh(b"abc")
    put(disk, upload)

    def fail(*_: object) -> None:
        raise OSError(errno.EIO, "no")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", fail)
        assert get(disk, upload) is None
    assert disk.tally.read_failures == 1
    assert get(disk, upload) == upload


def test_a_file_that_can_not_be_deleted_stays_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Disk(tmp_path, 2 * BLOCK)
    a, b, c = (numbered(number) for number in range(3))
    put(disk, a)
    put(disk, b)

    def fail(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "no")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", fail)
        assert not put(disk, c)
    assert (disk.size, disk.entries) == (2 * BLOCK, 2)
    assert put(disk, c)
    assert get(disk, a) is None


def test_a_folder_that_can_not_be_is_told_of_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    for folder in (tmp_path / "file", tmp_path / "file" / "store"):
        with pytest.raises(StoreFault, match=r"STORE_DIR=.*unset it"):
            Disk(folder, AMPLE)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 256 KiB."""
    folder = tmp_path / "small"
    folder.mkdir()
    if os.geteuid() != 0:
        pytest.skip("only root may mount")
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
    if subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("a tmpfs can't be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_keeps_what_it_has_and_goes_on_once_there_is_room(small_disk: Path) -> None:
    disk = Disk(small_disk, AMPLE)
    first = numbered(1, 100_000)
    assert put(disk, first)
    filler = small_disk / "filler"
    filler.write_bytes(bytes(120_000))
    assert not put(disk, numbered(2, 100_000))
    assert disk.tally.write_failures == 1
    assert get(disk, first) == first
    assert len(files(small_disk)) == 2
    filler.unlink()
    assert put(disk, numbered(2, 100_000))
    disk.close()


def test_a_read_only_disk_serves_what_it_has(small_disk: Path) -> None:
    disk = Disk(small_disk, AMPLE)
    kept = mesh(b"abc")
    put(disk, kept)
    disk.close()
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    disk = Disk(small_disk, AMPLE)
    assert get(disk, kept) == kept
    assert put(disk, kept)
    assert not put(disk, mesh(b"def"))
    assert (disk.entries, disk.tally.write_failures) == (1, 1)
    # Even a budget that is overdrawn is no reason not to start.
    assert get(Disk(small_disk, 0), kept) == kept
    with pytest.raises(StoreFault, match="Read-only"):
        Disk(small_disk / "new", AMPLE)


PROGRAM = """
import os, sys
from pathlib import Path
from service.requests import Upload
from service.store.address import Address
from service.store.disk import Disk

disk = Disk(Path(sys.argv[1]), 1 << 30)
number = 0
while True:
    upload = Upload(os.urandom(8) * (1000 * (number % 50)), f"{number}.obj")
    if disk.put(Address(upload.mesh_id, ""), upload):
        print(upload.mesh_id, flush=True)
    number += 1
"""


def test_what_was_promised_is_there_after_a_kill(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    promised = [process.stdout.readline().strip() for _ in range(40)]
    process.kill()
    promised += [line.strip() for line in process.stdout if line.endswith("\n")]
    process.wait()
    process.stdout.close()
    disk = Disk(tmp_path, AMPLE)
    for mesh_id in promised:
        upload = disk.get(Address(mesh_id, ""))
        assert upload is not None
        assert upload.mesh_id == mesh_id
    assert len(files(tmp_path)) == disk.entries >= 40
