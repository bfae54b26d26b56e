"""A zip archive with one mesh in it, beside its materials, buffers, textures and whatever else."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import PurePosixPath

from service.mesh.archive import Archive
from service.mesh.faults import quoted, unsupported
from service.mesh.folder import Folder
from service.mesh.gltf import GltfFile
from service.mesh.meshfile import Faces, Linear, MeshFile, Vertices

ARCHIVES = ("zip", "7z", "rar", "gz", "tar", "usdz", "3mf")
# Names that a message lists.
NAMED = 5


class ZippedFile(MeshFile):
    """An archive that answers as the mesh in it does; `format` is that mesh's.

    Attributes:
        inner: that mesh.
        folder: it is in.
    """

    media_type = "application/zip"

    def __init__(self, data: bytes, readers: Mapping[str, type[MeshFile]]) -> None:
        """Read the mesh in `data` by the one of `readers` that its suffix tells.

        Raises:
            UnsupportedFormat: the archive holds no mesh or several, or can't be read.
            InvalidMesh, TooLarge: the archive or the mesh is broken, or unfolds too far.
        """
        self.data = data
        self._archive = Archive(data)
        self._member = mesh_member(list(self._archive.members), readers)
        reader, content = readers[_suffix(self._member)], self._archive.read(self._member)
        self.folder = Folder(self._archive, self._member)
        if issubclass(reader, GltfFile):
            self.inner: MeshFile = reader(content, self.folder)
        else:
            self.inner = reader(content)
        self.format = self.inner.format
        self.vertices = self.inner.vertices
        self.faces = self.inner.faces

    @property
    def suffix(self) -> str:
        """See `MeshFile.suffix`."""
        return "zip"

    @property
    def visible(self) -> Faces:
        """See `MeshFile.visible`."""
        return self.inner.visible

    @property
    def parts(self) -> int:
        """See `MeshFile.parts`: members of the archive."""
        return self._archive.parts

    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        """See `MeshFile.write`; only members that hold what moved differ."""
        written = self.inner.write_files(vertices, linear)
        return self._archive.replaced({name or self._member: c for name, c in written.items()})


def mesh_member(names: Collection[str], suffixes: Collection[str]) -> str:
    """The one of an archive's `names` that is a mesh.

    Raises:
        UnsupportedFormat: ``archive_without_mesh``, ``nested_archive`` or ``several_meshes``.
    """
    shown = [name for name in names if not _hidden(name)]
    meshes = [name for name in shown if _suffix(name) in suffixes]
    if len(meshes) == 1:
        return meshes[0]
    if meshes:
        raise unsupported(
            "several_meshes",
            f"The archive holds {len(meshes)} meshes: {_listed(meshes)}",
            "Upload the one to be edited, by itself or in an archive with no other mesh",
        )
    nested = [name for name in shown if _suffix(name) in ARCHIVES]
    if nested:
        raise unsupported(
            "nested_archive",
            f"The archive holds no mesh, but another archive: {_listed(nested)}",
            "Upload that archive, or the mesh in it",
        )
    raise unsupported(
        "archive_without_mesh",
        f"The archive holds no mesh of a known format, but {_listed(shown) or 'nothing'}",
        f"Zip one of {', '.join(suffixes)} with its materials and textures",
    )


def _suffix(name: str) -> str:
    return PurePosixPath(name).suffix.lower().removeprefix(".")


def _hidden(name: str) -> bool:
    """Whether a member is one of the notes that macOS adds to archives, or hidden."""
    path = PurePosixPath(name)
    return path.name.startswith(".") or "__MACOSX" in path.parts


def _listed(names: list[str]) -> str:
    listed = ", ".join(quoted(name) for name in names[:NAMED])
    return listed + ", ..." if len(names) > NAMED else listed
