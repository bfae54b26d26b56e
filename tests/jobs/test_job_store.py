from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.errors import Conflict, Crowded, NotFound, Overloaded, TooLarge
from service.jobs.database import FILE
from service.jobs.job import Failure, Job
from service.jobs.making import Part
from service.jobs.order import Order
from service.jobs.store import LEASE_S, Bounds, Gone, JobStore, LeaseLost
from service.store.fault import StoreFault

MakeOrder = Callable[..., Order]
BOUNDS = Bounds(open=4, bytes=10_000, seconds=100.0)


def part(index: int, data: bytes | None = b"data") -> Part:
    name = None if data is None else f"variants/{index:03d}.glb"
    return Part(name, data, {"index": index, "file": name})


@pytest.fixture(params=["memory", "disk"])
def store(request: Any, tmp_path: Path, clock: Any) -> JobStore:
    return JobStore(None if request.param == "memory" else tmp_path, BOUNDS, clock)


def carried_out(store: JobStore, lease: str = "a") -> Job:
    """The next job, with all of its variants."""
    taken = store.claim(lease)
    assert taken is not None
    for index in range(taken[0].total):
        store.save(taken[0].id, lease, index, part(index))
    return store.finish(taken[0].id, lease)


def test_a_job_from_its_order_to_its_files(store: JobStore, order: MakeOrder) -> None:
    asked = order(2)
    job = store.submit(asked, "ann", "trace")
    assert (job.status, job.done, job.total, job.version) == ("queued", 0, 2, 1)
    assert store.waiting()
    taken = store.claim("a")
    assert taken is not None
    assert taken[1] == asked.upload
    assert Order.read(taken[0].order, taken[1]) == asked
    store.save(job.id, "a", 0, part(0))
    store.save(job.id, "a", 1, part(1, None))
    store.save_labels(job.id, "a", b"{}")
    assert store.get(job.id, "ann").done == 2
    ended = store.finish(job.id, "a")
    assert (ended.status, store.jobs("ann")) == ("succeeded", [ended])
    assert [name for name, _ in store.files(job.id, 2)] == [
        "variants/000.glb",
        "manifest.jsonl",
        "labels.json",
    ]
    assert not store.waiting()


def test_a_job_is_its_owners_alone(store: JobStore, order: MakeOrder) -> None:
    job = store.submit(order(), "ann", "trace")
    for look in (store.get, store.end):
        with pytest.raises(NotFound, match="job_unknown"):
            look(job.id, "bob")
    assert store.jobs("bob") == []


def test_each_change_has_a_version_of_its_own(store: JobStore, order: MakeOrder) -> None:
    job = store.submit(order(2), "", "trace")
    versions = [job.version]
    store.claim("a")
    for index in range(2):
        versions.append(store.get(job.id, "").version)
        store.save(job.id, "a", index, part(index))
    versions += [store.get(job.id, "").version, store.finish(job.id, "a").version]
    assert versions == sorted(set(versions))


def test_a_key_gives_the_same_job_again(store: JobStore, order: MakeOrder) -> None:
    job = store.submit(order(), "ann", "trace", "key")
    assert store.submit(order(), "ann", "other", "key") == job
    with pytest.raises(Conflict, match="idempotency_conflict"):
        store.submit(order(first=2.0), "ann", "trace", "key")
    assert store.submit(order(first=2.0), "bob", "trace", "key").id != job.id


def test_a_cancelled_job_is_nobodys_work(store: JobStore, order: MakeOrder) -> None:
    job = store.submit(order(), "", "trace")
    store.claim("a")
    store.save(job.id, "a", 0, part(0))
    cancelled = store.end(job.id, "")
    assert cancelled is not None
    assert cancelled.status == "cancelled"
    assert not store.holds(job.id, "a")
    with pytest.raises(LeaseLost):
        store.save(job.id, "a", 1, part(1))
    assert store.end(job.id, "") is None
    with pytest.raises(NotFound):
        store.get(job.id, "")


def test_a_result_that_is_removed_while_it_is_read(store: JobStore, order: MakeOrder) -> None:
    job = store.submit(order(3), "", "trace")
    carried_out(store)
    files = store.files(job.id, 3)
    next(files)
    store.end(job.id, "")
    with pytest.raises(Gone):
        list(files)


def test_all_goes_a_while_after_the_end(store: JobStore, order: MakeOrder, clock: Any) -> None:
    job = store.submit(order(), "", "trace")
    clock.now += 99
    ended = carried_out(store)
    assert ended.expires == clock.now + 100
    clock.now += 99
    assert (store.sweep(), store.get(job.id, "")) == (0, ended)
    clock.now += 1
    with pytest.raises(NotFound):
        store.get(job.id, "")
    assert store.sweep() == 1
    assert store.counts()[1] == 0


def test_owners_take_turns(store: JobStore, order: MakeOrder, clock: Any) -> None:
    for owner in ("ann", "ann", "bob"):
        store.submit(order(1), owner, "trace")
        clock.now += 1
    owners = []
    for _ in range(3):
        owners.append(carried_out(store).owner)
        clock.now += 1
    assert owners == ["ann", "bob", "ann"]


def test_bounds(store: JobStore, order: MakeOrder) -> None:
    with pytest.raises(TooLarge, match="job_too_large"):
        store.submit(order(999, 11), "", "trace")
    with pytest.raises(TooLarge, match="job_too_large"):
        store.submit(order(1, 2501), "ann", "trace")
    for _ in range(2):
        store.submit(order(1), "ann", "trace")
    with pytest.raises(Crowded, match="jobs_full"):
        store.submit(order(1), "ann", "trace")
    store.submit(order(1), "bob", "trace")
    store.submit(order(1), "", "trace")
    with pytest.raises(Crowded, match="jobs_full"):
        store.submit(order(1), "", "trace")


def test_bytes_are_bounded_before_and_while_they_come(store: JobStore, order: MakeOrder) -> None:
    store.submit(order(1, 4000), "", "trace")
    with pytest.raises(Crowded, match="jobs_full"):
        store.submit(order(1, 2000), "", "trace")
    taken = store.claim("a")
    assert taken is not None
    with pytest.raises(TooLarge, match="job_too_large"):
        store.save(taken[0].id, "a", 0, part(0, b"y" * 7000))
    assert store.get(taken[0].id, "").done == 0
    failure = Failure("TooLarge", "job_too_large", "d", "s", {})
    ended = store.finish(taken[0].id, "a", failure)
    assert (ended.status, Failure.read(ended.problem or "")) == ("failed", failure)
    assert store.counts()[1] == 0


def test_a_runner_that_is_gone_is_followed(store: JobStore, order: MakeOrder, clock: Any) -> None:
    job = store.submit(order(), "", "trace")
    store.claim("a")
    store.save(job.id, "a", 0, part(0))
    assert store.claim("b") is None
    clock.now += LEASE_S
    taken = store.claim("b")
    assert taken is not None
    assert (taken[0].id, taken[0].done) == (job.id, 1)
    with pytest.raises(LeaseLost):
        store.renew(job.id, "a")


def test_a_job_that_is_released_goes_on_at_once(store: JobStore, order: MakeOrder) -> None:
    store.submit(order(), "", "trace")
    attempts = []
    for failed in (False, True, False):
        taken = store.claim("a")
        assert taken is not None
        attempts.append(taken[0].attempts)
        store.release(taken[0].id, "a", failed=failed)
    assert attempts == [1, 1, 2]


def test_another_process_sees_the_same(tmp_path: Path, order: MakeOrder, clock: Any) -> None:
    one, other = JobStore(tmp_path, BOUNDS, clock), JobStore(tmp_path, BOUNDS, clock)
    job = one.submit(order(), "", "trace")
    assert other.get(job.id, "") == job
    taken = other.claim("b")
    assert taken is not None
    assert one.claim("a") is None
    one.end(job.id, "")
    assert not other.holds(job.id, "b")


def test_it_outlives_its_process(tmp_path: Path, order: MakeOrder, clock: Any) -> None:
    store = JobStore(tmp_path, BOUNDS, clock)
    job = store.submit(order(), "", "trace")
    store.claim("a")
    store.save(job.id, "a", 0, part(0))
    store.close()
    # Nobody else has the folder: the lease of who is gone is not waited for.
    taken = JobStore(tmp_path, BOUNDS, clock).claim("b")
    assert taken is not None
    assert taken[0].done == 1


def test_deleted_bytes_leave_the_file(tmp_path: Path, order: MakeOrder) -> None:
    store = JobStore(tmp_path, Bounds(4, 1 << 24, 100.0))
    job = store.submit(order(1, 1 << 20), "", "trace")
    store.end(job.id, "")
    store.close()
    assert (tmp_path / FILE).stat().st_size < 1 << 18
    assert (tmp_path / FILE).stat().st_mode & 0o077 == 0


def test_what_is_no_database_takes_only_jobs_down(tmp_path: Path, order: MakeOrder) -> None:
    (tmp_path / FILE).write_bytes(b"no database" * 1000)
    store = JobStore(tmp_path, BOUNDS)
    with pytest.raises(Overloaded, match="jobs_unavailable"):
        store.submit(order(), "", "trace")
    assert store.faults >= 1
    (tmp_path / FILE).unlink()
    assert store.submit(order(), "", "trace").status == "queued"


def test_a_full_disk(tmp_path: Path, order: MakeOrder) -> None:
    store = JobStore(tmp_path, Bounds(4, 1 << 24, 100.0))
    with store._database.transaction() as db:
        (pages,) = db.execute("PRAGMA page_count").fetchone()
    store._database._open().execute(f"PRAGMA max_page_count = {pages + 2}")
    with pytest.raises(Overloaded, match="jobs_unavailable"):
        store.submit(order(1, 1 << 20), "", "trace")
    assert store.jobs("") == []
    assert store.submit(order(1, 10), "", "trace").status == "queued"


def test_a_database_of_another_version_is_not_touched(tmp_path: Path, order: MakeOrder) -> None:
    with sqlite3.connect(tmp_path / FILE) as db:
        db.execute("PRAGMA user_version = 99")
    db.close()
    with pytest.raises(Overloaded, match="jobs_unavailable"):
        JobStore(tmp_path, BOUNDS).submit(order(), "", "trace")


def test_a_folder_that_can_not_be(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StoreFault, match="JOBS_DIR"):
        JobStore(tmp_path / "file" / "jobs", BOUNDS)
