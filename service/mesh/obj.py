"""Wavefront OBJ.

Only the numbers of ``v`` and ``vn`` lines change; vertex colours and weights behind the
coordinates, comments, materials, groups and texture coordinates keep their bytes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.mesh import moves
from service.mesh.corners import NORMAL, POSITION, Corners
from service.mesh.faults import face_out_of_range, malformed, unsupported
from service.mesh.meshfile import Linear, MeshFile, Vertices
from service.mesh.polygons import fan
from service.mesh.replacement import rewrite
from service.mesh.textlines import TextLines, holds
from service.mesh.triples import Triples


class ObjFile(MeshFile):
    """An OBJ file.

    Attributes:
        lines: of the text.
        vertex_lines: ``[V]`` where each vertex is.
        corners: of the faces.
        corner_vertices, corner_normals: ``[C]`` what each of them uses; -1 without a normal.
        normals: ``[N, 3]``.
    """

    format = "obj"
    media_type = "model/obj"

    def __init__(self, data: bytes) -> None:
        """Read `data`; InvalidMesh when that can't be."""
        self.data = data
        self.lines = lines = TextLines("obj", data, continued=True)
        _refuse_free_form(lines)
        self._positions = Triples(lines, b"v")
        self.vertex_lines = self._positions.lines
        self._normals = Triples(lines, b"vn")
        self.normals = self._normals.values
        self.corners = Corners(lines)
        self.corner_vertices = self.corners.indices(POSITION, self._positions.lines)
        self.corner_normals = self.corners.indices(NORMAL, self._normals.lines)
        count, used = len(self._positions.lines), self.corner_vertices
        # Of every face, also those of too few corners to be a triangle.
        wrong = used[(used < 0) | (used >= count)]
        if count and len(wrong):
            raise face_out_of_range(int(wrong[0]), count)
        if self.corner_normals.max(initial=-1) >= len(self._normals.lines):
            raise malformed("obj", "a face uses a normal that isn't there")
        self.vertices = self._positions.values
        self.faces = fan(self.corner_vertices, self.corners.counts)

    @moves.tolerant
    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        """See `MeshFile.write`."""
        change = moves.compare(self.vertices, vertices, linear)
        if not change.any:
            return self.data
        moved = self._positions.changed(change.moved, vertices)
        turned = self._normals.changed(*self._turned_normals(change))
        return rewrite(self.data, [moved, turned])

    def _turned_normals(self, change: moves.Moves) -> tuple[NDArray[np.bool_], Vertices]:
        """Which normals turn, ``[N]``, and all normals after, ``[N, 3]``.

        A normal that several vertices use takes the mean of what their maps make of it.
        """
        values = self.normals
        turned = np.zeros(len(values), bool)
        used = self.corner_normals >= 0
        vertex, normal = self.corner_vertices[used], self.corner_normals[used]
        turned[normal[change.turned[vertex]]] = True
        affected = turned[normal]
        pairs = np.unique(normal[affected] * len(self.vertices) + vertex[affected])
        normal, vertex = np.divmod(pairs, len(self.vertices))
        mapped = moves.turn_normals(values[normal], change.linear[vertex])
        sums = [np.bincount(normal, mapped[:, i], len(turned)) for i in range(3)]
        total: Vertices = np.stack(sums, axis=1).astype(np.float64)
        return turned, moves.unit(total, values)


def _refuse_free_form(lines: TextLines) -> None:
    for keyword in (b"surf", b"curv", b"curv2"):
        if holds(lines.data, keyword) and len(lines.beginning(keyword)[0]):
            raise unsupported(
                "free_form",
                f"The file has free-form curves or surfaces ({keyword.decode()})",
                "Convert them to polygons and export the mesh again",
            )
