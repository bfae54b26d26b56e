"""Polygons, fans and strips as triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.mesh.meshfile import Faces

Indices = NDArray[np.int64]


def as_indices(values: NDArray[Any]) -> Indices:
    """Numbers of a file as int64; one that is no integer that fits becomes an invalid index."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.int64)


def fan(corners: Indices, counts: Indices) -> Faces:
    """Triangles of polygons, each fanned from its first corner.

    Args:
        corners: ``[C]`` vertex indices of all polygons, one polygon after the other.
        counts: ``[P]`` corners of each polygon, summing to C.  Less than 3 gives no triangle.

    Returns:
        ``[F, 3]``, in the order of the polygons.
    """
    if len(counts) == 0:
        return np.empty((0, 3), np.int64)
    if counts[0] == 3 and (counts == 3).all():
        return corners.reshape(-1, 3)
    triangles = np.maximum(counts - 2, 0)
    first = np.repeat(np.cumsum(counts) - counts, triangles)
    step = np.arange(len(first)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return np.stack([corners[first], corners[first + step + 1], corners[first + step + 2]], axis=1)


def strip(corners: Indices) -> Faces:
    """Triangles of one or more strips; a negative index ends a strip and starts the next.

    Args:
        corners: ``[C]`` vertex indices.

    Returns:
        ``[F, 3]``, every second triangle turned round so that all face the same way; triangles
        that repeat a vertex only join strips, and are left out.
    """
    if len(corners) < 3:
        return np.empty((0, 3), np.int64)
    order = np.arange(len(corners))
    start = np.maximum.accumulate(np.where(corners < 0, order + 1, 0))
    odd = ((order - start)[:-2] % 2).astype(bool)
    a, b, c = corners[:-2], corners[1:-1], corners[2:]
    faces = np.stack([a, np.where(odd, c, b), np.where(odd, b, c)], axis=1)
    distinct = (a != b) & (b != c) & (a != c)
    kept: Faces = faces[distinct & (faces >= 0).all(axis=1)]
    return kept
