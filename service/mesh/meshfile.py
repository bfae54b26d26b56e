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
        format: lower-case format name, e.g. ``"glb"``; also the file suffix.
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
