"""Files that the service answers with."""

from __future__ import annotations

import json
import re
import shutil
import zipfile
from dataclasses import dataclass, field
from email.message import Message
from functools import cached_property
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, Self
from urllib.parse import unquote

import httpx


@dataclass(frozen=True)
class File:
    """A file that was answered, in memory or where it was written to.

    Attributes:
        filename: what the service calls it; never with a folder.
        media_type: such as `model/gltf-binary`.
        etag: the answer's, if it has one.
        content: its bytes; None where it was written to `path`.
        path: where it was written.
    """

    filename: str
    media_type: str
    etag: str | None
    content: bytes | None = field(repr=False)
    path: Path | None

    @classmethod
    def of(cls, headers: httpx.Headers, content: bytes | None, path: Path | None) -> Self:
        """The file of an answer."""
        media_type = headers.get("content-type", "").partition(";")[0].strip()
        name = _name(headers.get("content-disposition", "")) or "mesh"
        return cls(name, media_type, headers.get("etag"), content, path)

    @property
    def data(self) -> bytes:
        """All of it.

        Raises:
            OSError: when it was written to a path and can't be read there.
        """
        if self.content is not None:
            return self.content
        assert self.path is not None
        return self.path.read_bytes()

    def save(self, path: str | PathLike[str]) -> Path:
        """Write it.

        Args:
            path: a file, or a folder to put it into under its own name.

        Returns:
            Where it lies.

        Raises:
            OSError: when it can't be written.
        """
        place = Path(path)
        if place.is_dir():
            place = place / self.filename
        if self.content is not None:
            place.write_bytes(self.content)
        elif self.path is not None and self.path.resolve() != place.resolve():
            shutil.copyfile(self.path, place)
        return place


@dataclass(frozen=True)
class Edited(File):
    """An edited mesh.

    Attributes:
        parameters: the values after the edit, by name; lengths in the upload's unit.
    """

    parameters: dict[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, headers: httpx.Headers, content: bytes | None, path: Path | None) -> Self:
        """The file of an answer.

        Raises:
            ValueError: when the header is no JSON object of numbers.
        """
        plain = File.of(headers, content, path)
        told = json.loads(headers.get("shape-parameters", "{}"))
        if not isinstance(told, dict):
            raise ValueError("Shape-Parameters is no object")
        values = {name: float(value) for name, value in told.items()}
        return cls(plain.filename, plain.media_type, plain.etag, content, path, values)


@dataclass(frozen=True)
class Archive(File):
    """A zip of variants: `variants/000.glb ...`, `manifest.jsonl`, and of an augmentation
    `labels.json`."""

    @classmethod
    def of(cls, headers: httpx.Headers, content: bytes | None, path: Path | None) -> Self:
        """The file of an answer.

        Raises:
            ValueError: when it is no zip.
        """
        plain = File.of(headers, content, path)
        whole: Any = path if content is None else BytesIO(content)
        if not zipfile.is_zipfile(whole):
            raise ValueError("it is no zip")
        name = plain.filename if plain.filename != "mesh" else "variants.zip"
        return cls(name, plain.media_type, plain.etag, content, path)

    def open(self) -> zipfile.ZipFile:
        """The zip; close it, or use it in a `with`."""
        source: BinaryIO | Path = BytesIO(self.content) if self.content is not None else self._path
        return zipfile.ZipFile(source)

    @cached_property
    def manifest(self) -> list[dict[str, Any]]:
        """A row a variant: `index`, `status`, `file`, `edits`, `parameters` and more; where it
        could not be made, `status` is not `ok`, `file` is None, and `problem` says why."""
        with self.open() as archive:
            lines = archive.read("manifest.jsonl").decode().splitlines()
        return [json.loads(line) for line in lines if line.strip()]

    @cached_property
    def labels(self) -> dict[str, Any] | None:
        """Of an augmentation: `parts`, their names, and `labels`, the part of each vertex."""
        with self.open() as archive:
            if "labels.json" not in archive.namelist():
                return None
            return json.loads(archive.read("labels.json"))

    def read(self, name: str) -> bytes:
        """One of its files.

        Args:
            name: such as a manifest's `file`.

        Raises:
            KeyError: when there is none of this name.
        """
        with self.open() as archive:
            return archive.read(name)

    def extract(self, folder: str | PathLike[str]) -> Path:
        """Write all of its files into a folder, which is made where it is missing."""
        with self.open() as archive:
            archive.extractall(folder)
        return Path(folder)

    @property
    def _path(self) -> Path:
        assert self.path is not None
        return self.path


def _name(disposition: str) -> str:
    """The file name of a `Content-Disposition`, without folders: it comes from elsewhere."""
    message = Message()
    message["content-disposition"] = disposition
    if found := re.search(r"filename\*=UTF-8''([^;\s]+)", disposition, re.IGNORECASE):
        name = unquote(found[1])
    else:
        name = message.get_filename() or ""
    last = re.split(r"[/\\]", name)[-1]
    return "".join(c for c in last if c.isprintable()).strip(" .")
