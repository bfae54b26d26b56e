"""Vertices at one position made one, and the graph of the surface that results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

MERGES = 3
_CELLS = (1 << 21) - 1
# Odd factors without a pattern in their bits, to spread keys over a table.
_SPREAD = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)


@dataclass(frozen=True)
class Welded:
    """A mesh without seams.

    Attributes:
        vertices: ``[n, 3]`` positions, distinct within a piece, in the order of the mesh's.
        of: ``[V]`` which of them each vertex of the mesh is at.
        first: ``[n]`` the first of the mesh's vertices at each.
        faces: ``[F, 3]`` indices into them, each corner's in one run of memory.
        piece: ``[n]`` which connected piece a position belongs to.
        pieces: how many pieces there are.
    """

    vertices: NDArray[np.float64]
    of: Index
    first: Index
    faces: Index
    piece: Index
    pieces: int

    @property
    def seamless(self) -> bool:
        """Whether the mesh was so already: `of` and `first` leave all as it is."""
        return len(self.first) == len(self.of)

    @property
    def rows(self) -> Index | slice:
        """`first`, as what takes no time where it is all."""
        return slice(None) if self.seamless else self.first

    def boxes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Low and high corners of the pieces' bounding boxes, both ``[pieces, 3]``."""
        order, starts = runs(self.piece)
        columns = np.stack([column[order] for column in self.vertices.T])
        return np.minimum.reduceat(columns, starts, axis=1).T, np.maximum.reduceat(
            columns, starts, axis=1
        ).T


def runs(piece: Index) -> tuple[Index, Index]:
    """The order that puts the vertices of a piece together, and where in it each piece starts.

    Args:
        piece: ``[n]``.
    """
    if (piece[1:] >= piece[:-1]).all():
        order = np.arange(len(piece))
    else:
        # Numbers of two bytes are sorted in a tenth of the time.
        small = piece.astype(np.uint16) if piece.max() < 1 << 16 else piece
        order = np.argsort(small, kind="stable")
    return order, np.flatnonzero(np.diff(piece[order], prepend=-1))


def weld(vertices: NDArray[np.float64], faces: Index) -> Welded:
    """Join the vertices that share a position, to 1 / 2,000,000 of the mesh's extent.

    Faces belong to one piece when a chain of shared vertices, or of edges at the same place,
    connects them: boxes of their own that touch at a corner stay two.  Vertices without a face
    form a piece of their own.

    Args:
        vertices: ``[V, 3]`` finite.
        faces: ``[F, 3]`` indices into them.
    """
    columns = np.ascontiguousarray(vertices.T)
    step = max(float(np.ptp(columns, axis=1).max()), np.finfo(float).tiny) / _CELLS
    x, y, z = (np.rint((x - x.min()) / step).astype(np.int64) for x in columns)
    first, position = _distinct((x << 42) | (y << 21) | z)
    corners = np.ascontiguousarray(faces.T)
    piece, pieces = _pieces(corners, position)
    if len(first) == len(vertices):
        return Welded(vertices, position, first, corners.T, piece, pieces)
    first, of = _distinct(position * pieces + piece)
    return Welded(vertices[first], of, first, np.take(of, corners).T, piece[first], pieces)


def _distinct(keys: Index) -> tuple[Index, Index]:
    """Where each of the distinct ``keys [n]`` is found first, and ``[n]`` which each of them is.

    By a table, in a fraction of a sort's time; the few keys that share a slot with others are
    tried again in another order of the table, and in the end sorted.
    """
    found, rest = np.empty(len(keys), np.int64), np.arange(len(keys))
    bits = len(keys).bit_length() + 2
    table = np.empty(1 << bits, np.int64)
    for factor in _SPREAD:
        slot = (keys[rest].view(np.uint64) * np.uint64(factor) >> np.uint64(64 - bits)).view(
            np.int64
        )
        # Of those that share a slot the last that is written stays: the first of all.
        table[slot[::-1]] = rest[::-1]
        winner = table[slot]
        found[rest] = winner
        rest = rest[keys[winner] != keys[rest]]
    _, first, of = np.unique(keys[rest], return_index=True, return_inverse=True)
    found[rest] = rest[first[of]]
    own = found == np.arange(len(keys))
    return np.flatnonzero(own), (np.cumsum(own) - 1)[found]


def _pieces(corners: Index, position: Index) -> tuple[Index, int]:
    """``[V]`` which piece each vertex belongs to, and how many there are.

    Args:
        corners: ``[3, F]`` of the faces.
        position: ``[V]`` of the vertices.
    """
    piece, count = _linked(corners, len(position))
    stray = np.ones(len(position), bool)
    for corner in corners:
        stray[corner] = False
    piece[stray] = count
    # Only edges between places that several of the pieces so far share can join these.
    at = np.empty(len(position), np.int64)
    at[position] = piece
    shared = np.zeros(len(position), bool)
    shared[position[at[position] != piece]] = True
    if shared.any():
        piece = _joined(corners, position, shared[position], piece, count)
    names = np.bincount(piece) > 0
    return (np.cumsum(names) - 1)[piece], int(names.sum())


def _linked(corners: Index, count: int) -> tuple[Index, int]:
    """``[count]`` which piece a vertex belongs to when pieces share no vertex, and their number.

    Most are soon merged with their neighbours; what is left is linked as a graph.
    """
    label = np.arange(count)
    for _ in range(MERGES):
        to, count = _merged(corners, count)
        label = to[label]
        a, b, c = (to[corner] for corner in corners)
        apart = np.flatnonzero((a != b) | (a != c))
        corners = np.stack([a[apart], b[apart], c[apart]])
        if not corners.size:
            return label, count
    count, to = _components(corners[:2].ravel(), corners[1:].ravel(), count)
    return to[label], count


def _merged(corners: Index, count: int) -> tuple[Index, int]:
    """``[count]`` which node each becomes as it is merged with one of a lower number in a face of
    its own, and that with one lower still, and how many nodes there then are."""
    lowest = np.minimum(np.minimum(corners[0], corners[1]), corners[2])
    root = np.arange(count)
    for corner in corners:
        root[corner] = np.minimum(lowest, root[corner])
    while True:
        lower = root[root]
        if np.array_equal(lower, root):
            break
        root = lower
    own = root == np.arange(count)
    return (np.cumsum(own) - 1)[root], int(own.sum())


def _joined(
    corners: Index, position: Index, shared: NDArray[np.bool_], piece: Index, count: int
) -> Index:
    """``[V]`` pieces once those are one that have an edge at the same place.

    Args:
        corners: ``[3, F]`` of the faces.
        position: ``[V]`` of the vertices.
        shared: ``[V]`` whether any other piece has a vertex there.
        piece: ``[V]`` pieces so far, the last of which, `count`, has no faces.
    """
    sides, on = [], [shared[corner] for corner in corners]
    for side in range(3):
        rows = np.flatnonzero(on[side] & on[side - 1])
        start, end = corners[side], corners[side - 1]
        one, other = position[start[rows]], position[end[rows]]
        key = np.minimum(one, other) * len(position) + np.maximum(one, other)
        sides.append(np.stack([key, piece[start[rows]]]))
    key, own = np.concatenate(sides, axis=1)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(np.diff(key[order]) == 0)
    label = _components(own[order[same]], own[order[same + 1]], count + 1)[1]
    return label[piece]


def _components(first: Index, second: Index, count: int) -> tuple[int, Index]:
    """How many components there are of the nodes that the pairs link, and ``[count]`` which each is
    in."""
    links = csr_array((np.ones(len(first)), (first, second)), shape=(count, count))
    pieces, label = connected_components(links, directed=False)
    return pieces, label.astype(np.int64)
