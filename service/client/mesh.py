"""Meshes to send: content that can be read again, and the id that stands for it."""

from __future__ import annotations

import io
import os
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import BinaryIO

from service.client.files import File

MESH_ID = re.compile(r"sha256-[0-9a-f]{64}")

# A service that keeps no meshes would cost each call a refusal.
MISSES = 3

Stamp = tuple[int, int]
"""When a file was last written, in ns, and its size in bytes."""


class Mesh:
    """A mesh to send, which remembers the id that the service keeps it under.

    The first call sends the content; after a report of it, later calls send but the `mesh_id`.
    Where the service keeps it no more, the client sends the content again by itself.

    A path is read anew at each sending, a chunk at a time.  A file object is read from where it
    stands; where it can't be rewound it is read into memory.  Threads and tasks may share a mesh.

    Args:
        source: a path, the file's bytes, or a binary file object.
        name: the file's name, whose suffix tells the format; by default the path's.

    Attributes:
        name: as above; `mesh` where there is none.
        mesh_id: what it is kept under, None before that is known.

    Raises:
        TypeError: when the source is none of these, or a file in text mode.
        FileNotFoundError: when there is no such file.
    """

    def __init__(
        self, source: str | os.PathLike[str] | bytes | BinaryIO, name: str | None = None
    ) -> None:
        self._open, own = _opener(source)
        self.name = name or own or "mesh"
        self._mesh_id: str | None = None
        self._misses = 0
        self._path = Path(source) if isinstance(source, str | os.PathLike) else None
        self._stamp: Stamp | None = None
        self._sent: Stamp | None = _stamp(self._path)
        self._lock = threading.Lock()

    @classmethod
    def kept(cls, mesh_id: str) -> Mesh:
        """A mesh that the service keeps, without its content.

        Args:
            mesh_id: as a report named it.
        """
        mesh = cls(b"")
        mesh._open, mesh._mesh_id = None, mesh_id
        return mesh

    @property
    def mesh_id(self) -> str | None:
        """What the service keeps it under; None when that is not known, or the file has changed."""
        with self._lock:
            if self._mesh_id is not None and self._stamp != _stamp(self._path):
                self._mesh_id = None
            return self._mesh_id

    @property
    def has_content(self) -> bool:
        """Whether it can be sent, and not only named."""
        return self._open is not None

    def remember(self, mesh_id: str) -> None:
        """Name what was last sent so in later calls."""
        with self._lock:
            if self._misses < MISSES:
                self._mesh_id, self._stamp = mesh_id, self._sent

    def forget(self, mesh_id: str) -> None:
        """The service does not keep it under this id: send it whole next time."""
        with self._lock:
            if self._mesh_id == mesh_id:
                self._misses += 1
                self._mesh_id = None

    @contextmanager
    def open(self) -> Iterator[BinaryIO]:
        """The content from its beginning; the file's position at its end gives the size.

        Raises:
            ValueError: when there is only an id.
            OSError: when the file can't be read.
        """
        if self._open is None:
            raise ValueError(f"there is no content of {self._mesh_id}")
        self._sent = _stamp(self._path)
        with self._open() as file:
            yield file

    def __repr__(self) -> str:
        return f"Mesh({self.name!r}, mesh_id={self._mesh_id!r})"


MeshLike = Mesh | File | str | os.PathLike[str] | bytes | BinaryIO
"""What stands for a mesh: see `as_mesh`."""


def as_mesh(given: object) -> Mesh:
    """Whatever stands for a mesh, as one.

    Args:
        given: a `Mesh`, an answered file, a mesh_id, a path, bytes, or a binary file object.

    Raises:
        TypeError: when it is none of these.
    """
    match given:
        case Mesh():
            return given
        case File():
            return Mesh(given.data, given.filename)
        case str() if MESH_ID.fullmatch(given):
            return Mesh.kept(given)
        case str() | os.PathLike() | bytes():
            return Mesh(given)
        case _ if hasattr(given, "read"):
            return Mesh(given)  # type: ignore[arg-type]
    raise TypeError(f"a mesh is a path, bytes, a binary file, a Mesh or a mesh_id, not {given!r}")


class _View(io.RawIOBase):
    """A file from some position on, with a place of its own: several are read at the same time."""

    def __init__(self, file: BinaryIO, at: int, lock: threading.Lock) -> None:
        self._file, self._at, self._lock = file, at, lock

    def read(self, size: int = -1) -> bytes:
        with self._lock:
            self._file.seek(self._at)
            data = self._file.read(size)
            self._at = self._file.tell()
        return data

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        with self._lock:
            self._file.seek(self._at)
            self._at = self._file.seek(offset, whence)
        return self._at

    def tell(self) -> int:
        return self._at


def _opener(
    source: object,
) -> tuple[Callable[[], AbstractContextManager[BinaryIO]] | None, str | None]:
    if isinstance(source, bytes | bytearray | memoryview):
        data = bytes(source)
        return lambda: io.BytesIO(data), None
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        if not path.is_file():
            raise FileNotFoundError(f"there is no file {str(path)!r}")
        return lambda: path.open("rb"), path.name
    if isinstance(source, io.TextIOBase) or not hasattr(source, "read"):
        raise TypeError(f"a mesh is read from a path, bytes or a binary file, not {source!r}")
    return _of_file(source)  # type: ignore[arg-type]


def _of_file(file: BinaryIO) -> tuple[Callable[[], AbstractContextManager[BinaryIO]], str | None]:
    name = getattr(file, "name", None)
    own = Path(name).name if isinstance(name, str) else None
    if hasattr(file, "seekable") and file.seekable():
        at, lock = file.tell(), threading.Lock()
        return lambda: _View(file, at, lock), own  # type: ignore[return-value]
    data = file.read()
    return lambda: io.BytesIO(data), own


def _stamp(path: Path | None) -> Stamp | None:
    try:
        found = None if path is None else path.stat()
    except OSError:
        return None
    return None if found is None else (found.st_mtime_ns, found.st_size)
