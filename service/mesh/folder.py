"""The folder of an archive that a glTF file's references start from.  Nothing else is reachable."""

from __future__ import annotations

from pathlib import PurePosixPath
from urllib.parse import unquote

from service.errors import InvalidMesh
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
