"""Whether an edited mesh is a sound one (B6): flips, slivers and gaps; `crossed` has the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from model_export.benchmark.accuracy import diagonal
from service.deform.flips import counted
from service.deform.normals import face_crosses, vertex_normals

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

SLIVER = 1e-3
"""A face that loses all but this share of its area has degenerated."""
TOUCH = 5e-3
"""Vertices of two pieces that are nearer than this share of the diagonal touch."""


def flips(y: Array, reference: Array, faces: Faces) -> int:
    """Faces that face away from where they do in the reference: the true edit, or the input."""
    due, found = face_crosses(reference, faces), face_crosses(y, faces)
    against = np.einsum("fc,fc->f", due, found) < 0.0
    return int((against & counted(np.einsum("fc,fc->f", due, due))).sum())


def degenerate(y: Array, reference: Array, faces: Faces) -> int:
    """Faces that have an area in the reference and hardly any in ``y``."""
    due, found = (np.linalg.norm(face_crosses(v, faces), axis=1) for v in (reference, y))
    return int(((found < SLIVER * due) & counted(due**2)).sum())


def pieces(faces: Faces, count: int) -> NDArray[np.int64]:
    """``[V]`` the connected piece of each vertex."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    piece: NDArray[np.int64] = connected_components(graph, directed=False)[1]
    return piece


def contacts(x: Array, piece: NDArray[np.int64]) -> Faces:
    """``[n, 2]`` vertices of different pieces that touch, the nearest such of each vertex."""
    reach = TOUCH * diagonal(x)
    found = []
    for index in range(piece.max() + 1):
        own, others = np.flatnonzero(piece == index), np.flatnonzero(piece != index)
        if not len(others):
            break
        low, high = x[own].min(axis=0) - reach, x[own].max(axis=0) + reach
        others = others[((x[others] >= low) & (x[others] <= high)).all(axis=1)]
        if not len(others):
            continue
        distance, near = cKDTree(x[others]).query(x[own], distance_upper_bound=reach)
        hit = np.isfinite(distance)
        found.append(np.stack([own[hit], others[near[hit]]], axis=1))
    return np.concatenate(found) if found else np.zeros((0, 2), np.int64)


def gap(x: Array, y: Array, truth: Array | None, faces: Faces, touching: Faces) -> float:
    """The 99th percentile of how far what touched has come apart, over the diagonal.

    It is the distance of one vertex from the other's tangent plane, so that pieces may slide along
    each other; and where the truth opens a gap, it is none.
    """
    if not len(touching):
        return 0.0
    apart = [_apart(v, faces, touching) for v in (y, x, *([] if truth is None else [truth]))]
    opened = np.maximum(apart[0] - np.max(apart[1:], axis=0), 0.0)
    return float(np.quantile(opened, 0.99) / diagonal(x))


def _apart(v: Array, faces: Faces, touching: Faces) -> Array:
    normal = vertex_normals(v, faces)
    offset = v[touching[:, 0]] - v[touching[:, 1]]
    ends = [np.abs(np.einsum("nc,nc->n", offset, normal[touching[:, end]])) for end in (0, 1)]
    distance: Array = np.minimum(*ends)
    return distance
