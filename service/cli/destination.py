"""Files that go out: where to, never over another by a slip, and whole or not at all."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field
from pathlib import Path

import click

from service.cli.meshes import PIPE
from service.cli.problem import Problem, reason

SUFFIXES = ("glb", "gltf", "obj", "ply", "stl", "off")
"""Formats that can be asked for by a file's name."""


@dataclass
class Destination:
    """Where the results of a command go.

    Attributes:
        out: as the user names it: a file, a folder, ``-``, or nothing.
        force: whether files may be replaced.
        what: that is made; ends the names of files beside the input.
        many: whether there are several inputs.
    """

    out: str | None
    force: bool
    what: str
    many: bool = False
    _taken: set[Path] = field(default_factory=set)

    @property
    def folder(self) -> bool:
        """Whether it is a folder, there already or to be made."""
        return self.out is not None and (
            self.out.endswith(("/", os.sep)) or Path(self.out).is_dir()
        )

    @property
    def format(self) -> str | None:
        """The format that the file's name asks for; None where it asks for none."""
        if self.out is None or self.folder or self.out == PIPE:
            return None
        suffix = Path(self.out).suffix.lower().removeprefix(".")
        return suffix if suffix in SUFFIXES else None

    def piped(self, file: str) -> bool:
        """Whether the result of an input goes to standard output."""
        return self.out == PIPE or (self.out is None and file == PIPE)

    def require_sense(self, files: tuple[str, ...], as_json: bool) -> None:
        """Raise `click.UsageError` for a place that can't take what is to come."""
        piped = [file for file in files if self.piped(file)]
        if len(files) > 1 and (piped or not (self.out is None or self.folder)):
            raise click.UsageError(
                "Several files need a folder for what becomes of them: -o DIR/ (mind the slash)."
            )
        if piped and as_json:
            raise click.UsageError("--json and the file can't both go to standard output.")
        if piped and sys.stdout.isatty():
            raise click.UsageError("A mesh is nothing for a terminal: name a file, -o FILE.")

    def require_room(self, file: str, name: str | None, format: str | None) -> None:
        """As `path`, before there is a result: what can't be written need not be made.

        Args:
            file, name: as there.
            format: that is asked for; None keeps the file's own.
        """
        suffix = format or Path(name or "").suffix.lower().removeprefix(".")
        if suffix and not self.piped(file):
            self._require_free(self._path(file, name, suffix))

    def path(self, file: str, name: str | None, suffix: str) -> Path:
        """Where the result of an input goes; it is taken from then on.

        Args:
            file: the input.
            name: what it is called.
            suffix: of the result.

        Raises:
            Problem: when something is there, and may not be replaced.
        """
        return self._taking(self._path(file, name, suffix))

    def within(self, name: str) -> Path:
        """Where a file of that name goes in the folder, likewise."""
        assert self.out is not None
        return self._taking(Path(self.out) / name)

    def _taking(self, path: Path) -> Path:
        self._require_free(path)
        self._taken.add(path.resolve())
        return path

    def _path(self, file: str, name: str | None, suffix: str) -> Path:
        stem = Path(name or "mesh").stem
        if self.out is None:
            return Path(file).parent / f"{stem}-{self.what}.{suffix}"
        if self.folder:
            own = stem if self.what == "edited" else f"{stem}-{self.what}"
            return Path(self.out) / f"{own}.{suffix}"
        return Path(self.out)

    def _require_free(self, path: Path) -> None:
        if path.resolve() in self._taken:
            raise Problem(
                "output_twice",
                f"{str(path)!r} was written for another of the files just now.",
                "Files of one name need a folder each: call the command for each.",
            )
        if not self.force and path.is_file():
            raise Problem(
                "file_exists",
                f"{str(path)!r} is there already.",
                "Write to another file (-o), or replace it (--force).",
            )


def write(path: Path, data: bytes) -> None:
    """Write a file, so that at any time either all of it is there or what was before.

    Raises:
        Problem: when it can't be written.
    """
    path = path.resolve()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not path.is_file():
            path.write_bytes(data)  # a device or a pipe
            return
        beside = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            with beside.open("xb") as file:
                file.write(data)
            if path.exists():
                beside.chmod(path.stat().st_mode & 0o777)
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
    except OSError as error:
        raise Problem(
            "file_unwritable",
            f"{str(path)!r} can't be written: {reason(error)}.",
            "Check that the folder is there and may be written to.",
        ) from error
