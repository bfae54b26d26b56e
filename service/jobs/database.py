"""One SQLite database, of a file or of memory, that a fault of its disk never takes down."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from threading import RLock

from service.errors import Overloaded
from service.store.fault import StoreFault
from service.store.tally import Complaints

FILE = "jobs.sqlite"
BUSY_S = 5.0
"""How long another process's writing is waited for."""
VERSION = 1
"""Of the tables below; a database of another is not touched."""

_SETTINGS = """
PRAGMA auto_vacuum = INCREMENTAL;
PRAGMA journal_mode = WAL;
PRAGMA synchronous = FULL;
PRAGMA foreign_keys = ON;
PRAGMA secure_delete = ON;
"""
_TABLES = f"""
BEGIN IMMEDIATE;
CREATE TABLE IF NOT EXISTS jobs (
    id TEXT PRIMARY KEY, owner TEXT NOT NULL, kind TEXT NOT NULL, status TEXT NOT NULL,
    version INTEGER NOT NULL DEFAULT 1, done INTEGER NOT NULL DEFAULT 0, total INTEGER NOT NULL,
    created REAL NOT NULL, started REAL, finished REAL, expires REAL NOT NULL, problem TEXT,
    "order" TEXT NOT NULL, digest TEXT NOT NULL, key TEXT, name TEXT, content_type TEXT,
    makers TEXT, attempts INTEGER NOT NULL DEFAULT 0, trace_id TEXT NOT NULL,
    input_bytes INTEGER NOT NULL, part_bytes INTEGER NOT NULL DEFAULT 0, room INTEGER NOT NULL,
    lease TEXT, leased_until REAL NOT NULL DEFAULT 0, claimed REAL NOT NULL DEFAULT 0
);
CREATE UNIQUE INDEX IF NOT EXISTS jobs_by_key ON jobs (owner, key) WHERE key IS NOT NULL;
CREATE INDEX IF NOT EXISTS jobs_by_status ON jobs (status, leased_until);
CREATE TABLE IF NOT EXISTS inputs (
    job TEXT PRIMARY KEY REFERENCES jobs ON DELETE CASCADE, data BLOB NOT NULL
);
CREATE TABLE IF NOT EXISTS parts (
    job TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE, position INTEGER NOT NULL,
    name TEXT, line TEXT NOT NULL, data BLOB, PRIMARY KEY (job, position)
);
PRAGMA user_version = {VERSION};
COMMIT;
"""


class Database:
    """A connection for all threads, one at a time.

    Attributes:
        faults: how often it failed.
    """

    def __init__(self, folder: Path | None) -> None:
        """
        Args:
            folder: where its file is; it is made if there is none.  None for memory.

        Raises:
            StoreFault: when there is no such folder and it can't be made.
        """
        self.faults = 0
        self._path = None if folder is None else folder / FILE
        self._lock = RLock()
        self._complaints = Complaints("jobs")
        self._connection: sqlite3.Connection | None = None
        if folder is not None:
            try:
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                # Journals beside it get the same mode.
                (folder / FILE).touch(mode=0o600)
            except PermissionError as error:
                # One that can be read only is told of when jobs are asked for.
                if not folder.is_dir():
                    raise _unusable(folder, error) from error
            except OSError as error:
                if not folder.is_dir():
                    raise _unusable(folder, error) from error

    @contextlib.contextmanager
    def transaction(
        self, patience: float | None = None, writes: bool = True
    ) -> Iterator[sqlite3.Connection]:
        """All that is done in the block, or nothing.

        Args:
            writes: whether anything is changed; other processes may look meanwhile, not write.
            patience: seconds to wait for other threads; None for as long as it takes.

        Raises:
            Overloaded: `jobs_unavailable`: the disk is full, read-only or
                broken, or the file no database.
        """
        if not self._lock.acquire(timeout=-1 if patience is None else patience):
            raise _unavailable()
        try:
            connection = self._open()
            connection.execute("BEGIN IMMEDIATE" if writes else "BEGIN")
            try:
                yield connection
                connection.execute("COMMIT")
            except BaseException:
                with contextlib.suppress(sqlite3.Error):
                    if connection.in_transaction:
                        connection.execute("ROLLBACK")
                raise
        except sqlite3.Error as error:
            self.faults += 1
            self._complaints.say("failed", error)
            if not isinstance(error, sqlite3.OperationalError):
                self.close()
            raise _unavailable() from error
        finally:
            self._lock.release()

    def vacuum(self) -> None:
        """Give the room of what was deleted back."""
        with self._lock:
            try:
                if self._connection is not None:
                    # `execute` would free one page alone.
                    self._connection.executescript("PRAGMA incremental_vacuum")
            except sqlite3.Error as error:
                self._complaints.say("can't be made smaller", error)

    def close(self) -> None:
        """Let go of the file; it is opened again when it is asked for."""
        with self._lock:
            # What lies in memory alone would be lost.
            if self._connection is not None and self._path is not None:
                with contextlib.suppress(sqlite3.Error):
                    self._connection.close()
                self._connection = None

    def _open(self) -> sqlite3.Connection:
        if self._connection is None:
            where = ":memory:" if self._path is None else str(self._path)
            connection = sqlite3.connect(
                where, timeout=BUSY_S, isolation_level=None, check_same_thread=False
            )
            try:
                connection.row_factory = sqlite3.Row
                connection.executescript(_SETTINGS)
                (found,) = connection.execute("PRAGMA user_version").fetchone()
                if found not in (0, VERSION):
                    raise sqlite3.DatabaseError(f"{where} is of version {found}, not {VERSION}")
                if found == 0:
                    connection.executescript(_TABLES)
            except sqlite3.Error:
                connection.close()
                raise
            self._connection = connection
        return self._connection


def _unavailable() -> Overloaded:
    return Overloaded(
        "jobs_unavailable",
        "Jobs can't be kept at present: their database does not answer.",
        "Send the request without `Prefer: respond-async`, or again later; the operator finds the "
        "reason in the log.",
    )


def _unusable(folder: Path, error: OSError) -> StoreFault:
    return StoreFault(
        f"JOBS_DIR={str(folder)!r} can't be used: {error.strerror}. Name a folder that the service "
        "may read and write, or unset it."
    )
