"""STL, binary and ASCII: triangles that share no vertices.

Corners at the same place are one vertex.  Only the corners of moved vertices change, and the
normals of facets that have one.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from service.mesh import moves
from service.mesh.faults import malformed
from service.mesh.meshfile import Faces, Linear, MeshFile, Vertices
from service.mesh.polygons import Indices
from service.mesh.replacement import rewrite
from service.mesh.textlines import TextLines
from service.mesh.triples import Triples

HEADER = 80
BODY = HEADER + 4
# Spreads the bits of a place over a key: an odd number without a pattern.
KEY = np.uint64(0x9E3779B97F4A7C15)
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


class StlFile(MeshFile):
    """An STL file."""

    format = "stl"
    media_type = "model/stl"

    def __init__(self, data: bytes) -> None:
        """Read `data`; InvalidMesh when that can't be."""
        self.data = data
        text = is_ascii(data) and not is_binary(data)
        self._body: BinaryBody | AsciiBody = AsciiBody(data) if text else BinaryBody(data)
        corners = self._body.corners.reshape(-1, 3)
        first, vertex = merged(corners)
        self.vertices = corners[first].astype(np.float64)
        self.faces: Faces = vertex.reshape(-1, 3)

    @moves.tolerant
    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        """See `MeshFile.write`; facets have no use for `linear`, their normals follow corners."""
        change = moves.compare(self.vertices, vertices, linear)
        if not change.moved.any():
            return self.data
        corner_moved = np.take(change.moved, self.faces)
        corners = np.where(corner_moved[:, :, None], vertices[self.faces], self._body.corners)
        old = self._body.normals.astype(np.float64)
        facets = corners.astype(np.float64)
        across = np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0])
        # A normal of zero asks the reader to compute it: it stays zero.
        facing = moves.any_of_rows(corner_moved) & moves.any_of_rows(old != 0)
        normals = np.where(facing[:, None], moves.unit(across, old), self._body.normals)
        return self._body.write(corner_moved, corners, facing, normals)


class BinaryBody:
    """The facets of a binary file.

    Attributes:
        corners: ``[F, 3, 3]``.
        normals: ``[F, 3]``.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < BODY:
            raise malformed("stl", f"its {len(data)} bytes are neither facets nor a header")
        count = struct.unpack_from("<I", data, HEADER)[0]
        if BODY + count * FACET.itemsize > len(data):
            raise malformed("stl", f"it ends before the last of its {count} facets")
        self._data = data
        facets = np.frombuffer(data, FACET, count, BODY)
        self.corners = facets["corners"]
        self.normals = facets["normal"]

    def write(
        self,
        corner_moved: NDArray[np.bool_],
        corners: NDArray[np.float64],
        facing: NDArray[np.bool_],
        normals: NDArray[np.float64],
    ) -> bytes:
        """The file with the chosen corners ``[F, 3]`` and normals ``[F]`` replaced."""
        result = bytearray(self._data)
        facets = np.frombuffer(result, FACET, len(corners), BODY)
        facets["corners"][corner_moved] = corners[corner_moved]
        facets["normal"][facing] = normals[facing]
        return bytes(result)


class AsciiBody:
    """The facets of an ASCII file; attributes and `write` as in `BinaryBody`."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        lines = TextLines("stl", data)
        self._corners = Triples(lines, b"vertex")
        self._normals = Triples(lines, b"facet", b"normal")
        corners, facets = len(self._corners.lines), len(self._normals.lines)
        ended = len(lines.beginning(b"endfacet")[0])
        if corners != 3 * facets or ended != facets:
            raise malformed(
                "stl", f"it has {corners} vertices for {facets} facets, of which {ended} end"
            )
        self.corners = self._corners.values.reshape(-1, 3, 3)
        self.normals = self._normals.values

    def write(
        self,
        corner_moved: NDArray[np.bool_],
        corners: NDArray[np.float64],
        facing: NDArray[np.bool_],
        normals: NDArray[np.float64],
    ) -> bytes:
        """See `BinaryBody.write`."""
        moved = self._corners.changed(corner_moved.reshape(-1), corners.reshape(-1, 3))
        return rewrite(self._data, [moved, self._normals.changed(facing, normals)])


def is_binary(data: bytes) -> bool:
    """Whether `data` is just as long as a binary file of as many facets as it says."""
    if len(data) < BODY:
        return False
    count: int = struct.unpack_from("<I", data, HEADER)[0]
    return BODY + count * FACET.itemsize == len(data)


def is_ascii(data: bytes) -> bool:
    """Whether `data` is text; binary headers may begin with "solid" too, but their length tells."""
    start = data[:1024]
    return start.lstrip().lower().startswith(b"solid") and b"\0" not in start


def merged(corners: NDArray[np.floating]) -> tuple[Indices, Indices]:
    """Corners at the same place as one vertex.

    Args:
        corners: ``[C, 3]``.

    Returns:
        ``[V]`` the first corner of each vertex, in the order of corners, and ``[C]`` the vertex
        of each corner.
    """
    # Adding zero makes -0 and 0 the same bits.
    bits = np.ascontiguousarray(corners + corners.dtype.type(0)).view(f"u{corners.itemsize}")
    key = np.zeros(len(bits), np.uint64)
    for column in bits.T.astype(np.uint64):
        key = (key ^ column) * KEY
        key ^= key >> np.uint64(29)
    _, first, vertex = np.unique(key, return_index=True, return_inverse=True)
    if (bits[first][vertex] != bits).any():
        # Two places with one key: sort by the places themselves.
        _, first, vertex = np.unique(bits, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[vertex.reshape(-1)]
