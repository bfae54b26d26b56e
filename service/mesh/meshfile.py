"""The one shape that every mesh format is read into, and written back from."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

Vertices = NDArray[np.float64]
Faces = NDArray[np.int64]
Linear = NDArray[np.floating]


class MeshFile(ABC):
    """An uploaded file: its geometry in world space, and the way back into its own bytes.

    Attributes:
        format: lower-case name of the mesh's format, e.g. ``"glb"``.
        media_type: what an HTTP answer calls it.
        data: the file exactly as it came.
        vertices: ``[V, 3]`` world-space positions, in the file's own frame and units.
        faces: ``[F, 3]`` indices into ``vertices``; polygons are fanned into triangles.
    """

    format: str
    media_type: str
    data: bytes
    vertices: Vertices
    faces: Faces

    @abstractmethod
    def __init__(self, data: bytes) -> None: ...

    @property
    def suffix(self) -> str:
        """What the file's name ends in; the format but for an archive."""
        return self.format

    @property
    def visible(self) -> Faces:
        """``[G, 3]`` those of `faces` that are there to be seen, not for collisions."""
        return self.faces

    @property
    def parts(self) -> int:
        """How many parts of it have been read, where some are read when they are first needed."""
        return 1

    @abstractmethod
    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        """The same file with its vertices moved.

        Args:
            vertices: ``[V, 3]`` new world-space positions, in the order of ``self.vertices``.
            linear: ``[V, 3, 3]`` linear part of each vertex's map: tangents turn by it, normals
                by its inverse transpose.  Identity where nothing turned or stretched.

        Returns:
            The new file.  Values whose vertex did not move keep their bytes; when none moved the
            answer is ``self.data`` itself.
        """

    def write_files(self, vertices: Vertices, linear: Linear) -> dict[str, bytes]:
        """As `write`, with the new content of other files that the mesh lies in, by their names.

        The name of the mesh's own file is empty.
        """
        return {"": self.write(vertices, linear)}
