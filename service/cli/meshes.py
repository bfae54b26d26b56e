"""Meshes that come in: files, and what is piped in."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from service.cli.neighbours import gathered
from service.cli.problem import Problem, reason

PIPE = "-"
"""Stands for standard input, or output."""


@dataclass(frozen=True)
class Mesh:
    """A mesh file.

    Attributes:
        data: its bytes.
        name: what it is called, where that is known: the suffix tells the format.
        gathered: whether it is a zip of a file and of those that lay beside it.
    """

    data: bytes
    name: str | None
    gathered: bool = False


def read(file: str, name: str | None = None, looks: bool = False) -> Mesh:
    """A file with what it needs of those beside it, or what comes from standard input for ``-``.

    Args:
        file: its path, or ``-``.
        name: of what comes from standard input.
        looks: also gather materials and pictures that only the looks need.

    Raises:
        Problem: when it can't be read.
    """
    if file == PIPE:
        if sys.stdin is None or sys.stdin.isatty():
            raise Problem(
                "nothing_piped",
                "- is standard input, and nothing is piped into it.",
                "Pipe a mesh in, as in `cat chair.glb | shape-edit infer -`, or name a file.",
            )
        return Mesh(sys.stdin.buffer.read(), name)
    path = Path(file)
    try:
        data = path.read_bytes()
        together = gathered(path, data, looks)
        if together is not None:
            return Mesh(together, f"{path.stem}.zip", gathered=True)
        return Mesh(data, path.name)
    except FileNotFoundError:
        raise Problem(
            "file_missing", f"There is no file {file!r}.", "Check the path, or list the folder."
        ) from None
    except IsADirectoryError:
        raise Problem(
            "file_is_folder", f"{file!r} is a folder.", f"Name its files: {file.rstrip('/')}/*.glb."
        ) from None
    except OSError as error:
        raise Problem(
            "file_unreadable",
            f"{file!r} can't be read: {reason(error)}.",
            "Check its permissions.",
        ) from error
