"""The mesh files of a folder, and which of them are one machine's."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from service.augment.plan import Task
from service.errors import InvalidRequest, NotFound
from service.mesh.formats import READERS, ZIP

SUFFIXES = tuple(f".{name}" for name in (*READERS, ZIP))


def find_files(directory: Path, out: Path) -> list[Path]:
    """Mesh files in a folder and below it, sorted; hidden ones and what is in `out` left out.

    Raises:
        NotFound: when there is no such folder (``no_folder``), or no mesh in it (``no_meshes``).
    """
    if not directory.is_dir():
        raise NotFound("no_folder", f"{str(directory)!r} is no folder", "Name a folder of meshes.")
    found = sorted(_walk(directory, out.resolve()))
    if not found:
        raise NotFound(
            "no_meshes",
            f"there is no mesh in {str(directory)!r}",
            f"Files are found by their suffixes: {', '.join(SUFFIXES)}.",
        )
    return found


def _walk(directory: Path, out: Path) -> Iterator[Path]:
    for folder, inner, names in os.walk(directory):
        here = Path(folder)
        inner[:] = [n for n in inner if not n.startswith(".") and (here / n).resolve() != out]
        for name in names:
            if not name.startswith(".") and name.lower().endswith(SUFFIXES):
                yield here / name


def find_tasks(
    directory: Path, files: list[Path], shard: str, look: Callable[[], None]
) -> list[Task]:
    """What one machine has to do: its share of the files, equal ones once.

    Args:
        directory: that names are told from.
        files: in it.
        shard: ``i/n``, the i-th of n shares, by the files' content.
        look: called after each file that was looked at.

    Raises:
        InvalidRequest: for a shard that makes no sense (``shard_malformed``).
    """
    which, shards = read_shard(shard)
    first, copies = dict[str, Path](), dict[str, list[str]]()
    for path in files:
        digest = file_sha256(path)
        look()
        if int(digest[:16], 16) % shards == which:
            if digest in first:
                copies[digest].append(_name(path, directory))
            else:
                first[digest], copies[digest] = path, []
    return [
        Task(path, _name(path, directory), digest, tuple(copies[digest]))
        for digest, path in first.items()
    ]


def _name(path: Path, directory: Path) -> str:
    return path.relative_to(directory).as_posix()


def read_shard(shard: str) -> tuple[int, int]:
    """``2/8`` as 1 and 8.

    Raises:
        InvalidRequest: ``shard_malformed``.
    """
    which, slash, count = shard.partition("/")
    if slash and which.isdecimal() and count.isdecimal() and 1 <= int(which) <= int(count):
        return int(which) - 1, int(count)
    raise InvalidRequest(
        "shard_malformed",
        f"shard={shard[:40]!r} is no share",
        "Write i/n with i from 1 to n: 2/8 is the second of eight.",
    )


def file_sha256(path: Path) -> str:
    """Of a file's bytes, in hex; of none for a file that can't be read, which is told of later."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return hashlib.sha256(f"unreadable {path}".encode()).hexdigest()
