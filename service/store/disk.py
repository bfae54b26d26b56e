"""Kept meshes in a folder of this machine, for as long as it lasts."""

from __future__ import annotations

import contextlib
import os
import re
from collections import Counter, OrderedDict
from pathlib import Path
from threading import Lock

from service.requests import Upload
from service.store import entry
from service.store.address import Address
from service.store.fault import StoreFault
from service.store.holding import Holding
from service.store.tally import Complaints, Tally

BLOCK = 4096
"""Files are counted in whole blocks of so many bytes, as file systems do."""

_ENTRY = re.compile("[0-9a-f]{64}[.]mesh")
_PARTIAL = re.compile("[0-9a-f]{64}[.][0-9a-f]{16}[.]partial")


class Disk:
    """A tier bounded in bytes of files; the least recently used goes first.

    A mesh is there once `put` says so: its file is written aside, synced and renamed, and the
    folder synced, so that neither a kill nor a loss of power leaves half of it.  A disk that is
    full, read-only or broken is counted and complained of, never raised.

    File names are digests (`Address.name`); nothing else in the folder is touched.  Several
    processes may use one folder, as while one takes over from another; each keeps its own budget.

    Attributes:
        size, capacity: bytes that files take, begun ones included, and may take.
        tally: what happened so far.
    """

    name = "disk"

    def __init__(self, folder: Path, capacity: int) -> None:
        """Find what is kept there, and sweep up what a killed process left half-written.

        Raises:
            StoreFault: when there is no such folder and it can't be made, or can't be read.
        """
        self.capacity = capacity
        self.size = 0
        self.tally = Tally()
        self._folder = folder
        self._complaints = Complaints(self.name)
        self._entries: OrderedDict[str, int] = OrderedDict()
        # What is being written is not deleted: the new file would go in place of the old one.
        self._writing: Counter[str] = Counter()
        # Held for a moment to look or count; `_making_room` while files are deleted as well.
        self._lock = Lock()
        self._making_room = Lock()
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._holding = Holding(folder / ".lock")
            self._find()
        except OSError as error:
            raise StoreFault(
                f"STORE_DIR={str(folder)!r} can't be used: {error.strerror}. Name a folder that "
                "the service may read and write, or unset it to keep meshes in memory only."
            ) from error

    @property
    def entries(self) -> int:
        """How many meshes are held."""
        return len(self._entries)

    def put(self, address: Address, upload: Upload) -> bool:
        """Keep a mesh for good; False when it can't be, or is over the capacity."""
        name, head = address.name, entry.head(upload)
        length = len(head) + len(upload.data)
        size = _taken(length)
        with self._lock:
            self._writing[name] += 1
        try:
            if self._has(name, head, length) and self._use(name):
                return True
            if not self._reserve(size):
                return False
            try:
                self._write(name, head, upload.data)
            except OSError:
                with self._lock:
                    self.size -= size
                raise
        except OSError as error:
            self.tally.add("write_failures")
            self._complaints.say("can't write", error)
            return False
        else:
            with self._lock:
                self.size -= self._entries.pop(name, 0)
                self._entries[name] = size
            return True
        finally:
            with self._lock:
                self._writing[name] -= 1
                self._writing += Counter()  # which drops what is at 0

    def get(self, address: Address) -> Upload | None:
        """The mesh, which is now the most recently used; None when it is not there as it was."""
        name = address.name
        try:
            with self._path(name).open("rb") as file:
                upload = entry.read(file, address.mesh_id)
        except FileNotFoundError:
            self._forget(name)
            self.tally.add("misses")
            return None
        except entry.Corrupted:
            self._drop(name)
            self.tally.add("corrupted")
            self.tally.add("misses")
            self._complaints.say(f"found {name} altered and dropped it")
            return None
        except OSError as error:
            self.tally.add("read_failures")
            self.tally.add("misses")
            self._complaints.say("can't read", error)
            return None
        self._use(name)
        self.tally.add("hits")
        return upload

    def touch(self, address: Address) -> None:
        """Say that a mesh was used without being read from here; does not wait for the disk."""
        name = address.name
        with self._lock:
            if name in self._entries:
                self._entries.move_to_end(name)

    def close(self) -> None:
        """Let another process have the folder."""
        self._holding.close()

    def _find(self) -> None:
        """Index the folder in order of use, which files' times of change tell, and tidy it."""
        found = []
        with os.scandir(self._folder) as files:
            for file in files:
                if self._holding.alone and _PARTIAL.fullmatch(file.name):
                    with contextlib.suppress(OSError):
                        os.unlink(file.path)
                elif _ENTRY.fullmatch(file.name):
                    with contextlib.suppress(FileNotFoundError):
                        facts = file.stat(follow_symlinks=False)
                        found.append((facts.st_mtime_ns, file.name[:64], _taken(facts.st_size)))
        for _, name, size in sorted(found):
            self._entries[name] = size
            self.size += size
        try:
            self._reserve(0)
        except OSError as error:
            self._complaints.say("can't be brought down to its budget", error)
        self._holding.share()

    def _has(self, name: str, head: bytes, length: int) -> bool:
        """Whether the file is there, as long and with the same head."""
        with self._lock:
            if name not in self._entries:
                return False
        try:
            with self._path(name).open("rb") as file:
                whole = os.fstat(file.fileno()).st_size == length
                return whole and file.read(len(head)) == head
        except FileNotFoundError:
            self._forget(name)
            return False

    def _use(self, name: str) -> bool:
        """Make it the most recently used, after a restart as well; False when it is just going."""
        with self._lock:
            if name not in self._entries:
                return False
            self._entries.move_to_end(name)
        # A read-only disk still serves what it has.
        with contextlib.suppress(OSError):
            os.utime(self._path(name))
        return True

    def _reserve(self, size: int) -> bool:
        """Delete what was not used for longest until `size` more fits, and count it as taken."""
        if size > self.capacity:
            return False
        with self._making_room:
            while True:
                with self._lock:
                    if self.size + size <= self.capacity:
                        self.size += size
                        return True
                    idle = (name for name in self._entries if name not in self._writing)
                    if (name := next(idle, None)) is None:
                        return False
                    freed = self._entries.pop(name)
                try:
                    self._path(name).unlink(missing_ok=True)
                except OSError:
                    with self._lock:
                        self._entries[name] = freed
                        self._entries.move_to_end(name, last=False)
                    raise
                with self._lock:
                    self.size -= freed
                self.tally.add("evictions")

    def _write(self, name: str, head: bytes, data: bytes) -> None:
        """The file of an entry, whole and synced, in one step."""
        path = self._path(name)
        partial = path.with_name(f"{name}.{os.urandom(8).hex()}.partial")
        try:
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
            with open(os.open(partial, flags, 0o600), "wb") as file:
                file.write(head)
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.replace(partial, path)
        except OSError:
            with contextlib.suppress(OSError):
                partial.unlink(missing_ok=True)
            raise
        try:
            _sync_folder(self._folder)
        except OSError:
            self._drop(name)
            raise

    def _drop(self, name: str) -> None:
        with contextlib.suppress(OSError):
            self._path(name).unlink(missing_ok=True)
        self._forget(name)

    def _forget(self, name: str) -> None:
        with self._lock:
            self.size -= self._entries.pop(name, 0)

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.mesh"


def _taken(size: int) -> int:
    """Bytes of disk that a file of `size` bytes takes."""
    return -(-size // BLOCK) * BLOCK


def _sync_folder(folder: Path) -> None:
    """Make a rename in the folder survive a loss of power."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
