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
    count = int(faces.max()) + 1
    label = _components(faces[:, :2].ravel(), faces[:, 1:].ravel(), count)[faces[:, 0]]
    # Only edges between places that several of the pieces so far share can join these.
    at = np.zeros(int(welded.max()) + 1, np.int64)
    at[welded] = label[:, None]
    shared = np.zeros(len(at), bool)
    shared[welded[at[welded] != label[:, None]]] = True
    start, end = welded, welded[:, [1, 2, 0]]
    face, side = np.nonzero(shared[start] & shared[end])
    start, end = start[face, side], end[face, side]
    key = np.minimum(start, end) * len(at) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(np.diff(key[order]) == 0)
    first, second = label[face[order[same]]], label[face[order[same + 1]]]
    label = _components(first, second, count)[label]
    names, of_face = np.unique(label, return_inverse=True)
    return len(names), of_face


def _components(
    first: NDArray[np.int64], second: NDArray[np.int64], count: int
) -> NDArray[np.int64]:
    """``[count]`` which component each of the nodes is in that the pairs link."""
    links = csr_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    label: NDArray[np.int64] = connected_components(links, directed=False)[1]
    return label
