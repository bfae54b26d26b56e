"""glTF with its buffers embedded as data URIs or beside it in an archive; the base of GLB too."""

from __future__ import annotations

from typing import Any

from service.mesh import moves
from service.mesh.buffers import Buffers, Draft, Files, data_uri
from service.mesh.document import Document
from service.mesh.geometry import read_geometry
from service.mesh.gltfpatch import Patch
from service.mesh.jsontext import Path, splice
from service.mesh.meshfile import Faces, Linear, MeshFile, Vertices


class GltfFile(MeshFile):
    """A ``.gltf`` file."""

    format = "gltf"
    media_type = "model/gltf+json"

    def __init__(self, data: bytes, files: Files | None = None) -> None:
        """Read `data`; InvalidMesh or UnsupportedFormat when that can't be.

        Without the `files` that came with it, it must hold all of its geometry.
        """
        self.data = data
        self._files = files
        self.document, self.buffers = self._open()
        self.geometry = read_geometry(self.document, self.buffers)
        self.vertices = self.geometry.vertices
        self.faces = self.geometry.faces

    @property
    def visible(self) -> Faces:
        """See `MeshFile.visible`; all faces where no node is there to be seen."""
        return self.geometry.visible

    def beside(self, uri: str) -> bytes | None:
        """A file that came with the asset; None without any, ShapeError where it isn't there."""
        return None if self._files is None else self._files.read(self._files.locate(uri))

    def _open(self) -> tuple[Document, Buffers]:
        document = Document(self.format, self.data)
        return document, Buffers(document, files=self._files)

    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        """See `MeshFile.write`; with files beside it, `write_files` has those that change too."""
        return self.write_files(vertices, linear)[""]

    @moves.tolerant
    def write_files(self, vertices: Vertices, linear: Linear) -> dict[str, bytes]:
        """See `MeshFile.write_files`."""
        change = moves.compare(self.vertices, vertices, linear)
        if not change.any:
            return {"": self.data}
        patch = Patch(self.document, self.buffers, self.geometry)
        patch.apply(change)
        return self.assemble(patch.edits, patch.draft)

    def assemble(self, edits: dict[Path, Any], draft: Draft) -> dict[str, bytes]:
        """The files with other JSON values and other buffers; see `MeshFile.write_files`."""
        chunk = None
        files: dict[str, bytes] = {}
        for index, content in draft.changed().items():
            entry = self.document.entry("buffers", index)
            if len(content) != entry["byteLength"]:
                edits["buffers", index, "byteLength"] = len(content)
            if self.buffers.in_chunk(index):
                chunk = content
            elif name := self.buffers.file(index):
                files[name] = self.buffers.rewritten(index, content)
            else:
                edits["buffers", index, "uri"] = data_uri(entry["uri"], content)
        if not edits and chunk is None:
            return {"": self.data, **files}
        text = self.document.text
        return {"": self._pack(splice(text, edits) if edits else text, chunk), **files}

    def _pack(self, text: str, chunk: bytes | bytearray | None) -> bytes:
        """The file from its JSON `text` and, if it changed, the content of its binary chunk."""
        return text.encode()
