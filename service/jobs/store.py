"""Jobs, their meshes and their variants, in one database."""

from __future__ import annotations

import sqlite3
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from service.errors import Conflict, Crowded, NotFound, Overloaded, TooLarge
from service.jobs.archive import contents
from service.jobs.database import Database
from service.jobs.job import Failure, Job, Status, new_id
from service.jobs.making import Part
from service.jobs.order import Order
from service.requests import Upload
from service.store.holding import Holding

LEASE_S = 15.0
"""How long a job is its runner's without a word of it."""
MOST_FINISHED = 1000
"""Finished jobs that are remembered; the oldest go first."""
LABELS_AT = -1
"""Position of the labels among a job's parts."""

_COLUMNS = ", ".join(
    f'"{name}"' for name in (field.name for field in fields(Job)) if name != "durable"
)
_FINISHED = "('succeeded', 'failed', 'cancelled')"


@dataclass(frozen=True)
class Bounds:
    """What jobs may take.

    Attributes:
        open: jobs that are not finished; an owner may have half of them.
        bytes: of all meshes and variants; half of them an owner's.
        seconds: that a job is kept after its last change.
    """

    open: int
    bytes: int
    seconds: float


class LeaseLost(Exception):
    """The job was cancelled, or taken over."""


class Gone(Exception):
    """The job is there no more."""


class JobStore:
    """Safe to use from several threads, and its folder from several processes.

    Every method raises `Overloaded` (``jobs_unavailable``) when the database can't be used.

    Attributes:
        bounds: as given.
        durable: whether jobs outlive the process.
        changes: grows with each change that this process makes.
    """

    def __init__(
        self, folder: Path | None, bounds: Bounds, clock: Callable[[], float] = time.time
    ) -> None:
        """
        Args:
            folder: None to keep them in memory.
            clock: seconds since the epoch.

        Raises:
            StoreFault: when the folder can't be made.
        """
        self.bounds = bounds
        self.durable = folder is not None
        self.changes = 0
        self._clock = clock
        self._database = Database(folder)
        self._holding = None if folder is None else Holding(folder / ".lock")
        self._counts: tuple[Counter[str], int] = Counter(), 0
        if self._holding is not None:
            if self._holding.alone:
                self._free_leases()
            self._holding.share()

    @property
    def faults(self) -> int:
        """How often the database failed."""
        return self._database.faults

    def submit(self, order: Order, owner: str, trace_id: str, key: str | None = None) -> Job:
        """A job for an order; the same again for the same key.

        Raises:
            Conflict: ``idempotency_conflict``: the key is another order's.
            TooLarge: ``job_too_large``: it would take more than all there is.
            Crowded: ``jobs_full``.
        """
        now, upload = self._clock(), order.upload
        taken = len(upload.data)
        room = taken * (1 + order.total)
        with self._database.transaction() as db:
            if key is not None and (known := _by_key(db, owner, key)) is not None:
                if known["digest"] != order.digest():
                    raise _conflict()
                return self._job(known)
            self._sweep(db, now)
            self._require_room(db, owner, room)
            job_id = new_id()
            db.execute(
                'INSERT INTO jobs (id, owner, kind, status, total, created, expires, "order",'
                " digest, key, name, content_type, trace_id, input_bytes, room)"
                " VALUES (?, ?, ?, 'queued', ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    *(job_id, owner, order.kind, order.total, now, now + self.bounds.seconds),
                    *(order.text(), order.digest(), key, upload.name, upload.content_type),
                    *(trace_id, taken, room),
                ),
            )
            db.execute("INSERT INTO inputs VALUES (?, ?)", (job_id, upload.data))
            job = self._job(_row(db, job_id))
        self.changes += 1
        return job

    def get(self, job_id: str, owner: str) -> Job:
        """A job of an owner's.

        Raises:
            NotFound: ``job_unknown``.
        """
        with self._database.transaction(writes=False) as db:
            return self._own(db, job_id, owner)

    def jobs(self, owner: str) -> list[Job]:
        """All of an owner's, newest first."""
        with self._database.transaction(writes=False) as db:
            rows = db.execute(
                f"SELECT {_COLUMNS} FROM jobs WHERE owner = ? AND expires > ?"
                " ORDER BY created DESC, rowid DESC",
                (owner, self._clock()),
            )
            return [self._job(row) for row in rows]

    def files(self, job_id: str, total: int) -> Iterator[tuple[str, bytes]]:
        """The files of a job's archive, of so many variants, read one at a time.

        Raises:
            Gone: the job is removed meanwhile.
        """

        def labels() -> bytes | None:
            part = self._part(job_id, LABELS_AT)
            return None if part is None else part["data"]

        return contents(self._parts(job_id, total), labels)

    def end(self, job_id: str, owner: str) -> Job | None:
        """Cancel a job, or remove it when it is finished.

        Returns:
            The cancelled job; None for one that is removed.

        Raises:
            NotFound: ``job_unknown``.
        """
        with self._database.transaction() as db:
            job = self._own(db, job_id, owner)
            if job.is_open:
                self._finish(db, job_id, "cancelled", None)
                _drop_parts(db, job_id)
                told = self._job(_row(db, job_id))
            else:
                db.execute("DELETE FROM jobs WHERE id = ?", (job_id,))
                told = None
        self._changed()
        return told

    def waiting(self) -> bool:
        """Whether there is a job to be taken up."""
        with self._database.transaction(writes=False) as db:
            return _next(db, self._clock()) is not None

    def claim(self, lease: str) -> tuple[Job, Upload] | None:
        """Take up a job, in fair turn among owners, or one whose runner is gone."""
        now = self._clock()
        with self._database.transaction() as db:
            if (job_id := _next(db, now)) is None:
                return None
            db.execute(
                "UPDATE jobs SET version = version + (status = 'queued'), status = 'running',"
                " started = COALESCE(started, ?), claimed = ?, lease = ?, leased_until = ?,"
                " attempts = attempts + 1 WHERE id = ?",
                (now, now, lease, now + LEASE_S, job_id),
            )
            job = self._job(_row(db, job_id))
            data = db.execute("SELECT data FROM inputs WHERE job = ?", (job_id,)).fetchone()[0]
        self.changes += 1
        return job, Upload(data, job.name, job.content_type)

    def renew(self, job_id: str, lease: str) -> None:
        """Hold on to a job.

        Raises:
            LeaseLost: it is not the runner's any more.
        """
        with self._database.transaction() as db:
            self._hold(db, job_id, lease)

    def holds(self, job_id: str, lease: str) -> bool:
        """Whether a job is still the runner's."""
        with self._database.transaction(writes=False) as db:
            sql = "SELECT 1 FROM jobs WHERE id = ? AND lease = ? AND status = 'running'"
            return db.execute(sql, (job_id, lease)).fetchone() is not None

    def release(self, job_id: str, lease: str, failed: bool = False) -> None:
        """Let another take it up at once; it counts as an attempt where that has `failed`."""
        with self._database.transaction() as db:
            db.execute(
                "UPDATE jobs SET lease = NULL, leased_until = 0,"
                " attempts = MAX(attempts - ?, 0) WHERE id = ? AND lease = ?",
                (0 if failed else 1, job_id, lease),
            )

    def restart(self, job_id: str, lease: str, makers: str) -> None:
        """Forget the variants so far: they are to be made by others."""
        with self._database.transaction() as db:
            self._hold(db, job_id, lease)
            _drop_parts(db, job_id)
            db.execute(
                "UPDATE jobs SET makers = ?, version = version + (done > 0), done = 0,"
                " part_bytes = 0 WHERE id = ?",
                (makers, job_id),
            )
        self.changes += 1

    def save(self, job_id: str, lease: str, index: int, part: Part) -> None:
        """Keep a variant.

        Raises:
            LeaseLost: as `renew`.
            TooLarge: ``job_too_large``.
        """
        self._save(job_id, lease, index, part.name, part.line, part.data)

    def save_labels(self, job_id: str, lease: str, labels: bytes) -> None:
        """Keep a job's labels; raises as `save`."""
        self._save(job_id, lease, LABELS_AT, None, "", labels)

    def finish(self, job_id: str, lease: str, failure: Failure | None = None) -> Job:
        """It has succeeded, or failed.

        Raises:
            LeaseLost: as `renew`.
        """
        with self._database.transaction() as db:
            self._hold(db, job_id, lease)
            if failure is None:
                self._finish(db, job_id, "succeeded", None)
            else:
                self._finish(db, job_id, "failed", failure.text())
                _drop_parts(db, job_id)
            job = self._job(_row(db, job_id))
        self._changed()
        return job

    def sweep(self) -> int:
        """Delete what has expired; tells how many."""
        with self._database.transaction() as db:
            gone = self._sweep(db, self._clock())
        if gone:
            self._changed()
        return gone

    def counts(self) -> tuple[Counter[str], int]:
        """Jobs by status, and bytes that they take or may come to; of a moment ago where the
        database is busy."""
        try:
            with self._database.transaction(patience=0.05, writes=False) as db:
                found = db.execute("SELECT status, COUNT(*), SUM(room) FROM jobs GROUP BY status")
                rows = found.fetchall()
            self._counts = Counter({row[0]: row[1] for row in rows}), sum(row[2] for row in rows)
        except Overloaded:
            pass
        return self._counts

    def close(self) -> None:
        """Let others have the folder."""
        self._database.close()
        if self._holding is not None:
            self._holding.close()

    def _free_leases(self) -> None:
        """No other process is there: whoever held a job is dead."""
        try:
            with self._database.transaction() as db:
                db.execute("UPDATE jobs SET leased_until = 0 WHERE status = 'running'")
        except Overloaded:
            pass  # complained of; jobs are refused until it is mended

    def _parts(self, job_id: str, total: int) -> Iterator[tuple[str | None, str, bytes | None]]:
        for position in range(total):
            part = self._part(job_id, position)
            if part is None:
                raise Gone(job_id)
            yield part["name"], part["line"], part["data"]

    def _part(self, job_id: str, position: int) -> Any:
        with self._database.transaction(writes=False) as db:
            return db.execute(
                "SELECT name, line, data FROM parts WHERE job = ? AND position = ?",
                (job_id, position),
            ).fetchone()

    def _save(
        self, job_id: str, lease: str, at: int, name: str | None, line: str, data: bytes | None
    ) -> None:
        size = len(data or b"") + len(line)
        with self._database.transaction() as db:
            self._hold(db, job_id, lease)
            db.execute(
                "UPDATE jobs SET part_bytes = part_bytes + ?, done = MAX(done, ?), attempts = 0,"
                " room = MAX(room, input_bytes + part_bytes + ?), version = version + 1"
                " WHERE id = ?",
                (size, at + 1, size, job_id),
            )
            (all_bytes,) = db.execute("SELECT SUM(room) FROM jobs").fetchone()
            if all_bytes > self.bounds.bytes:
                raise _too_large(self.bounds.bytes)
            db.execute(
                "INSERT OR REPLACE INTO parts VALUES (?, ?, ?, ?, ?)",
                (job_id, at, name, line, data),
            )
        self.changes += 1

    def _hold(self, db: sqlite3.Connection, job_id: str, lease: str) -> None:
        now = self._clock()
        held = db.execute(
            "UPDATE jobs SET leased_until = ?, expires = ? WHERE id = ? AND lease = ?"
            " AND status = 'running'",
            (now + LEASE_S, now + self.bounds.seconds, job_id, lease),
        )
        if held.rowcount == 0:
            raise LeaseLost(job_id)

    def _finish(
        self, db: sqlite3.Connection, job_id: str, status: Status, problem: str | None
    ) -> None:
        """Note the end; the mesh is of no more use."""
        now = self._clock()
        kept = "part_bytes" if status == "succeeded" else "0"
        db.execute(
            "UPDATE jobs SET status = ?, problem = ?, finished = ?, expires = ?, lease = NULL,"
            f" room = {kept}, version = version + 1 WHERE id = ?",
            (status, problem, now, now + self.bounds.seconds, job_id),
        )
        db.execute("DELETE FROM inputs WHERE job = ?", (job_id,))

    def _require_room(self, db: sqlite3.Connection, owner: str, room: int) -> None:
        share = 2 if owner else 1
        limits = self.bounds.open // share or 1, self.bounds.bytes // share
        if room > limits[1]:
            raise _too_large(limits[1])
        for who, own, most_open, most_bytes in (
            ("You have", "owner = ?", *limits),
            ("There are", "? IS NOT NULL", self.bounds.open, self.bounds.bytes),
        ):
            jobs, taken = db.execute(
                f"SELECT COALESCE(SUM(status NOT IN {_FINISHED}), 0), COALESCE(SUM(room), 0)"
                f" FROM jobs WHERE {own}",
                (owner,),
            ).fetchone()
            if jobs >= most_open:
                raise _full(f"{who} {jobs} jobs that are not finished.")
            if taken + room > most_bytes:
                raise _full(f"{who} jobs of {taken} bytes, of {most_bytes} at most.")

    def _sweep(self, db: sqlite3.Connection, now: float) -> int:
        gone = db.execute("DELETE FROM jobs WHERE expires <= ?", (now,)).rowcount
        db.execute(
            f"DELETE FROM jobs WHERE status IN {_FINISHED} AND id NOT IN (SELECT id FROM jobs"
            f" WHERE status IN {_FINISHED} ORDER BY finished DESC LIMIT {MOST_FINISHED})"
        )
        return gone

    def _own(self, db: sqlite3.Connection, job_id: str, owner: str) -> Job:
        row = _row(db, job_id)
        if row is None or row["owner"] != owner or row["expires"] <= self._clock():
            raise NotFound(
                "job_unknown",
                f"There is no job {job_id[:40]!r} of yours.",
                "Jobs are kept for a while after their end; `GET /jobs` lists yours.",
            )
        return self._job(row)

    def _job(self, row: Any) -> Job:
        return Job(**{name: row[name] for name in row.keys()}, durable=self.durable)  # noqa: SIM118

    def _changed(self) -> None:
        self.changes += 1
        self._database.vacuum()


def _row(db: sqlite3.Connection, job_id: str) -> Any:
    return db.execute(f"SELECT {_COLUMNS} FROM jobs WHERE id = ?", (job_id,)).fetchone()


def _by_key(db: sqlite3.Connection, owner: str, key: str) -> Any:
    found = db.execute(
        f"SELECT {_COLUMNS} FROM jobs WHERE owner = ? AND key = ?", (owner, key)
    ).fetchone()
    return found


def _next(db: sqlite3.Connection, now: float) -> str | None:
    """The job whose turn it is: one that was left amid its work, else the oldest of the owner who
    was not served for longest."""
    found = db.execute(
        "SELECT id FROM jobs AS own WHERE expires > :now AND (status = 'queued' OR"
        " (status = 'running' AND leased_until <= :now)) ORDER BY status = 'queued',"
        " (SELECT MAX(claimed) FROM jobs WHERE owner = own.owner), created, rowid LIMIT 1",
        {"now": now},
    ).fetchone()
    return None if found is None else str(found["id"])


def _drop_parts(db: sqlite3.Connection, job_id: str) -> None:
    db.execute("DELETE FROM parts WHERE job = ?", (job_id,))


def _conflict() -> Conflict:
    return Conflict(
        "idempotency_conflict",
        "Another request was sent with this Idempotency-Key.",
        "Send each request with a key of its own, and the same key only to repeat it.",
    )


def _too_large(most: int) -> TooLarge:
    return TooLarge(
        "job_too_large",
        f"The job would take more than the {most} bytes that there are for it.",
        "Ask for fewer variants or a smaller mesh, or remove jobs that are finished.",
    )


def _full(detail: str) -> Crowded:
    return Crowded("jobs_full", detail, "Send it again after as many seconds as Retry-After says.")
