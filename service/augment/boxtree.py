"""Which faces of a mesh come near each other, found anew after each edit of the same mesh.

A tree of boxes over the faces, in an order along a space-filling curve that is made once: after an
edit only the boxes are, and pairs of boxes that overlap are followed down level by level.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]
Index = NDArray[np.int64]

FAN = 4
"""Boxes that one box of the next level holds."""
TOP = 16
"""Boxes with which a search begins, at most."""


class BoxTree:
    """A mesh's faces, in an order in which neighbours are near."""

    def __init__(self, vertices: Array, faces: Index) -> None:
        """
        Args:
            vertices: ``[n, 3]``.
            faces: ``[F, 3]``.
        """
        self._order = np.argsort(_curve(vertices[faces].mean(axis=1)), kind="stable")
        self._corners = np.ascontiguousarray(faces[self._order].T)

    def near(self, vertices: Array, reach: float = 0.0) -> Index:
        """``[m, 2]`` faces whose boxes are no farther apart than `reach` along any axis, with the
        vertices where they are now; the lesser index first, each pair once."""
        levels = self._levels(vertices, reach)
        low, _ = levels[-1]
        count = low.shape[1]
        first, second = np.triu_indices(count)
        for depth in range(len(levels) - 1, -1, -1):
            if depth < len(levels) - 1:
                first, second = _children(first, second, levels[depth][0].shape[1])
            first, second = _overlapping(levels[depth], first, second)
        apart = first != second
        pairs = self._order[np.stack([first[apart], second[apart]])]
        return np.sort(pairs, axis=0).T

    def _levels(self, vertices: Array, reach: float) -> list[tuple[Array32, Array32]]:
        """Low and high ends ``[3, n]`` of the faces' boxes, and of the boxes above them."""
        # In single precision, which is finer than whatever is asked of what lies in the boxes.
        columns = np.ascontiguousarray(vertices.T, np.float32)
        a, b, c = (columns[:, corner] for corner in self._corners)
        low = np.minimum(np.minimum(a, b), c)
        high = np.maximum(np.maximum(a, b), c) + np.float32(reach)
        levels = [(low, high)]
        while low.shape[1] > TOP:
            starts = np.arange(0, low.shape[1], FAN)
            low = np.minimum.reduceat(low, starts, axis=1)
            high = np.maximum.reduceat(high, starts, axis=1)
            levels.append((low, high))
        return levels


def _curve(points: Array) -> Index:
    """``[n]`` places of points on a curve that fills their bounding box (Morton's)."""
    span = np.maximum(np.ptp(points, axis=0), np.finfo(float).tiny)
    cells = ((points - points.min(axis=0)) / span * 1023).astype(np.int64)
    key = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            key |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return key


def _children(first: Index, second: Index, count: int) -> tuple[Index, Index]:
    """Pairs of the boxes within pairs of boxes, of which there are ``count``."""
    own, other = np.divmod(np.arange(FAN * FAN), FAN)
    a = (first[:, None] * FAN + own).ravel()
    b = (second[:, None] * FAN + other).ravel()
    there = (b < count) & (a <= b)
    return a[there], b[there]


def _overlapping(level: tuple[Array32, Array32], a: Index, b: Index) -> tuple[Index, Index]:
    """The pairs whose boxes overlap."""
    for low, high in zip(*level, strict=True):
        meet = (low[a] <= high[b]) & (low[b] <= high[a])
        a, b = a[meet], b[meet]
    return a, b
