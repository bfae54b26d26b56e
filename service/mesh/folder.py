"""The folder of an archive that a file's references start from.  Nothing else is reachable."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property
from pathlib import PurePosixPath
from urllib.parse import unquote

from service.errors import InvalidMesh, ShapeError
from service.mesh.archive import Archive
from service.mesh.faults import quoted, unsupported


class Folder:
    """Members of an archive by the URIs of a file in it."""

    def __init__(self, archive: Archive, file: str) -> None:
        """`file` is the member whose references are looked up."""
        self._archive = archive
        self._path = PurePosixPath(file).parent

    def locate(self, uri: str) -> str:
        """The name of the member that `uri` means.

        Raises:
            UnsupportedFormat: ``external_buffers``, it leads out of the folder.
            InvalidMesh: ``missing_buffer``.
        """
        # Some writers encode names and some don't: a name that is there as it stands is meant so.
        for path in (uri, unquote(uri)):
            steps = path.replace("\\", "/").split("/")
            if ":" in path or steps[0] == "" or ".." in steps:
                raise unsupported(
                    "external_buffers",
                    f"The geometry is outside of the archive's folder, at {quoted(uri)}",
                    "Put the .gltf and its .bin side by side into the archive, or upload a GLB",
                )
            name = str(self._path.joinpath(*steps))
            if name in self._archive.members:
                return name
        raise InvalidMesh(
            "missing_buffer",
            f"The glTF file needs {quoted(uri)}, which the archive does not hold.",
            "Put all files of the export into the archive, in the same folders.",
        )

    def read(self, name: str) -> bytes:
        """The content of a member that `locate` found."""
        return self._archive.read(name)

    def find(self, path: str) -> str | None:
        """The member that `path`, as another machine wrote it, must mean; None where none must.

        Programs write paths of the disk that they ran on, and names in letters of any case: where
        nothing is there as it is written, the only file of that name is meant.
        """
        if "\0" in path or not path.strip():
            return None
        try:
            return self.locate(path)
        except ShapeError:
            name = path.replace("\\", "/").rpartition("/")[2]
            for known in (name, unquote(name)):
                if len(found := self._by_name.get(known.casefold(), [])) == 1:
                    return found[0]
            return None

    def content(self, name: str, largest: int) -> bytes | None:
        """A member's content; None where it is larger, or can't be read."""
        if self._archive.members[name].size > largest:
            return None
        try:
            return self.read(name)
        except ShapeError:
            return None

    @cached_property
    def _by_name(self) -> dict[str, list[str]]:
        """The members in this folder and below by the names of their files, in lower case."""
        found: dict[str, list[str]] = defaultdict(list)
        for member in self._archive.members:
            path = PurePosixPath(member)
            if path.is_relative_to(self._path) and ".." not in path.parts:
                found[path.name.casefold()].append(member)
        return found
