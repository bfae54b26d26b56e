"""Vertices at one position made one, and the graph of the surface that results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

_CELLS = (1 << 21) - 1


@dataclass(frozen=True)
class Welded:
    """A mesh without seams.

    Attributes:
        vertices: ``[n, 3]`` positions, distinct within a piece.
        of: ``[V]`` which of them each vertex of the mesh is at.
        faces: ``[F, 3]`` indices into them.
        piece: ``[n]`` which connected piece a position belongs to.
        pieces: how many pieces there are.
    """

    vertices: NDArray[np.float64]
    of: NDArray[np.int64]
    faces: NDArray[np.int64]
    piece: NDArray[np.int64]
    pieces: int

    def boxes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Low and high corners of the pieces' bounding boxes, both ``[pieces, 3]``."""
        order = np.argsort(self.piece, kind="stable")
        starts = np.flatnonzero(np.diff(self.piece[order], prepend=-1))
        x = self.vertices[order]
        return np.minimum.reduceat(x, starts), np.maximum.reduceat(x, starts)


def weld(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Welded:
    """Join the vertices that share a position, to 1 / 2,000,000 of the mesh's extent.

    Faces belong to one piece when a chain of shared vertices, or of edges at the same place,
    connects them: boxes of their own that touch at a corner stay two.  Vertices without a face
    form a piece of their own.

    Args:
        vertices: ``[V, 3]`` finite.
        faces: ``[F, 3]`` indices into them.
    """
    low = vertices.min(axis=0)
    step = max(float((vertices.max(axis=0) - low).max()), np.finfo(float).tiny) / _CELLS
    cell = np.rint((vertices - low) / step).astype(np.int64)
    _, position = np.unique(
        (cell[:, 0] << 42) | (cell[:, 1] << 21) | cell[:, 2], return_inverse=True
    )
    pieces, of_face = _face_pieces(faces, position[faces])
    piece = np.full(len(vertices), pieces)
    piece[faces] = of_face[:, None]
    place = position * (pieces + 1) + piece
    _, first, of = np.unique(place, return_index=True, return_inverse=True)
    names, piece = np.unique(piece[first], return_inverse=True)
    return Welded(vertices[first], of, of[faces], piece, len(names))


def _face_pieces(
    faces: NDArray[np.int64], welded: NDArray[np.int64]
) -> tuple[int, NDArray[np.int64]]:
    """Count of the pieces, and ``[F]`` which each face belongs to."""
    if not len(faces):
        return 0, np.empty(0, np.int64)
    count = int(welded.max()) + 1
    start, end = welded, welded[:, [1, 2, 0]]
    key = np.minimum(start, end) * count + np.maximum(start, end)
    names, edge = np.unique(key, return_inverse=True)
    # Nodes are the edges, then the mesh's own vertices; a face links all of its six.
    nodes = np.concatenate([edge.reshape(-1, 3), faces + len(names)], axis=1)
    total = len(names) + int(faces.max()) + 1
    links = np.stack([nodes[:, :-1], nodes[:, 1:]]).reshape(2, -1)
    graph = csr_array((np.ones(links.shape[1], np.int8), tuple(links)), shape=(total, total))
    _, label = connected_components(graph, directed=False)
    names, of_face = np.unique(label[nodes[:, 0]], return_inverse=True)
    return len(names), of_face
