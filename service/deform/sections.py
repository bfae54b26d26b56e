"""Plane sections of a mesh: the closed curves that a row of parallel planes cuts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Sections:
    """Where the planes cut the edges of a mesh.

    Attributes:
        points: ``[n, 3]``.
        plane: ``[n]`` which plane cuts there.
        curve: ``[n]`` which connected curve the point lies on; each lies in one plane.
        curves: how many curves there are.
    """

    points: Array
    plane: Index
    curve: Index
    curves: int


def cut(u: Array, faces: Index, axis: int, levels: Array) -> Sections:
    """Cut a mesh by the planes where coordinate `axis` has each of the `levels`.

    Args:
        u: ``[n, 3]`` vertices, joined where faces meet.
        faces: ``[F, 3]``.
        levels: ``[k]`` ascending.
    """
    height = u[:, axis]
    # A vertex exactly on a plane counts as above it, so that every crossing is proper.
    rank = np.searchsorted(levels, height, side="right").astype(np.int16)[faces]
    a, b, c = rank.T
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    starts, planes = [np.empty((0, 2, 2), np.int64)], [np.empty(0, np.int64)]
    for plane in range(len(levels)):
        crossing = np.flatnonzero((low <= plane) & (high > plane))
        if len(crossing):
            starts.append(_crossed_edges(faces[crossing], rank[crossing] > plane))
            planes.append(np.full(len(crossing), plane))
    return _link(u, height, levels, np.concatenate(starts), np.concatenate(planes))


def _crossed_edges(faces: Index, above: NDArray[np.bool_]) -> Index:
    """``[m, 2, 2]`` the two edges of each face that run from below to above."""
    lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    row = np.arange(len(faces))
    apex = faces[row, lone]
    sides = np.stack([faces[row, (lone + 1) % 3], faces[row, (lone + 2) % 3]], axis=1)
    edges = np.stack([np.broadcast_to(apex[:, None], sides.shape), sides], axis=2)
    return np.sort(edges, axis=2)


def _link(u: Array, height: Array, levels: Array, edges: Index, plane: Index) -> Sections:
    """Points on the crossed edges, joined where a face crosses two."""
    count = len(u)
    key = (plane[:, None] * count + edges[:, :, 0]) * count + edges[:, :, 1]
    _, first, node = np.unique(key, return_index=True, return_inverse=True)
    node = node.reshape(-1, 2)
    ends = edges.reshape(-1, 2)[first]
    at = plane[first // 2]
    low, high = height[ends[:, 0]], height[ends[:, 1]]
    s = np.clip((levels[at] - low) / np.where(high == low, 1.0, high - low), 0.0, 1.0)[:, None]
    graph = csr_array(
        (np.ones(len(node), np.int8), (node[:, 0], node[:, 1])), shape=(len(first), len(first))
    )
    curves, curve = connected_components(graph, directed=False)
    return Sections(
        (1.0 - s) * u[ends[:, 0]] + s * u[ends[:, 1]], at, curve.astype(np.int64), int(curves)
    )
