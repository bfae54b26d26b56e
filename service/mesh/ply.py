"""PLY, ASCII and binary of either byte order.

Only the properties x, y, z and nx, ny, nz of moved vertices change.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from service.mesh import limits, moves
from service.mesh.faults import malformed, unsupported
from service.mesh.meshfile import Faces, Linear, MeshFile, Vertices
from service.mesh.plybody import Rows, as_doubles, read_rows
from service.mesh.plyheader import Header, read_header
from service.mesh.polygons import Indices, as_indices, fan, strip
from service.mesh.replacement import Replacement, rewrite
from service.mesh.textlines import Bytes, token_edges
from service.mesh.textlines import numbers as parse_numbers

POSITION = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
CORNERS = ("vertex_indices", "vertex_index")


class PlyFile(MeshFile):
    """A PLY file."""

    format = "ply"
    media_type = "application/x-ply"

    def __init__(self, data: bytes) -> None:
        """Read `data`; InvalidMesh or UnsupportedFormat when that can't be."""
        self.data = data
        self.header = read_header(data)
        self._edges: Indices | None = None
        elements = _read_elements(self.header, *self._body())
        self.rows = _vertex_rows(self.header, elements)
        self.vertices = self.columns(POSITION)
        self.faces = _faces(elements)

    def _body(self) -> tuple[memoryview, int]:
        """The bytes that hold the elements, and where these start."""
        if self.header.order:
            return memoryview(self.data), self.header.body
        text: Bytes = np.frombuffer(self.data, np.uint8, offset=self.header.body)
        self._edges = token_edges(text)
        parsed = parse_numbers("ply", text, len(self._edges) // 2, np.float64)
        return memoryview(parsed.tobytes()), 0

    def columns(self, names: Sequence[str]) -> Vertices:
        """``[V, C]`` scalar properties of the vertices."""
        columns = [self.rows.scalars[name] for name in names]
        return np.stack(columns, axis=1).astype(np.float64)

    @moves.tolerant
    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        """See `MeshFile.write`."""
        change = moves.compare(self.vertices, vertices, linear)
        columns: dict[str, tuple[Indices, Vertices]] = {}
        if change.moved.any():
            rows = np.flatnonzero(change.moved)
            columns |= {n: (rows, vertices[rows, i]) for i, n in enumerate(POSITION)}
        if change.turned.any() and all(name in self.rows.scalars for name in NORMAL):
            rows = np.flatnonzero(change.turned)
            turned = moves.turn_normals(self.columns(NORMAL)[rows], linear[rows])
            columns |= {n: (rows, turned[:, i]) for i, n in enumerate(NORMAL)}
        if not columns:
            return self.data
        self._check_integers(columns)
        return self._binary(columns) if self.header.order else self._ascii(columns)

    def _check_integers(self, columns: dict[str, tuple[Indices, Vertices]]) -> None:
        """UnsupportedFormat ``integer_coordinates`` for values that integers can't hold."""
        declared = [e.properties for e in self.header.elements if e.name == "vertex"][-1]
        for item in declared:
            if item.name not in columns or item.value.kind == "f":
                continue
            values, info = columns[item.name][1], np.iinfo(item.value.str)
            # Text has nine digits of each number.
            low, high = max(info.min, 1 - 10**9), min(info.max, 10**9 - 1)
            if ((values != np.rint(values)) | (values < low) | (values > high)).any():
                raise unsupported(
                    "integer_coordinates",
                    f"The PLY file stores {item.name!r} as {item.value.name}, which can't hold "
                    "where the edit moves its vertices",
                    "Export coordinates as float or double, or ask for another format",
                )

    def _binary(self, columns: dict[str, tuple[Indices, Vertices]]) -> bytes:
        data = np.frombuffer(bytearray(self.data), np.uint8)
        for name, (rows, values) in columns.items():
            dtype = self.rows.scalars[name].dtype
            spots = self.rows.places[name][rows]
            stored = values.astype(dtype).view(np.uint8).reshape(len(rows), -1)
            data[spots[:, None] + np.arange(dtype.itemsize)] = stored
        return data.tobytes()

    def _ascii(self, columns: dict[str, tuple[Indices, Vertices]]) -> bytes:
        assert self._edges is not None
        replacements = []
        for name, (rows, values) in columns.items():
            tokens = self.rows.places[name][rows] // np.dtype(np.float64).itemsize
            starts = self._edges[::2][tokens] + self.header.body
            ends = self._edges[1::2][tokens] + self.header.body
            old = self.rows.scalars[name][rows].astype(np.float64)
            replacements.append(Replacement(starts, ends, old, values))
        return rewrite(self.data, replacements)


def _read_elements(header: Header, body: memoryview, at: int) -> dict[str, Rows]:
    elements: dict[str, Rows] = {}
    for element in header.elements:
        # Before rows of different lengths are stepped through one by one.
        (limits.check_vertices if element.name == "vertex" else limits.check_faces)(element.count)
        elements[element.name] = read_rows(
            element if header.order else as_doubles(element), body, at
        )
        at = elements[element.name].end
    return elements


def _vertex_rows(header: Header, elements: dict[str, Rows]) -> Rows:
    if "vertex" not in elements or not all(n in elements["vertex"].scalars for n in POSITION):
        raise malformed("ply", "it has no 'vertex' element with x, y and z")
    return elements["vertex"]


def _faces(elements: dict[str, Rows]) -> Faces:
    found = [np.empty((0, 3), np.int64)]
    for name, triangulate in (("face", fan), ("tristrips", _strips)):
        for corners in CORNERS:
            if name in elements and corners in elements[name].lists:
                lists = elements[name].lists[corners]
                found.append(triangulate(as_indices(lists.values), lists.counts))
                break
    return np.concatenate(found) if len(found) > 2 else found[-1]


def _strips(corners: Indices, counts: Indices) -> Faces:
    """Strips of several rows, joined by the -1 that also parts the strips of one row."""
    return strip(np.insert(corners, np.cumsum(counts), -1))
