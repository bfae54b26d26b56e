"""A mesh with fewer vertices, by collapsing edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model_export.benchmark.detail import edges_of
from service.deform.normals import face_crosses
from service.deform.weld import weld

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

ROUND = 0.1
"""Share of the vertices, at most, that one round takes away: costs are of its beginning."""
SPREAD = 1e-3
"""Weight of distance along the surface, beside that from its planes, so that flat places
collapse evenly."""


def decimated(vertices: Array, faces: Faces, most: int) -> tuple[Array, Faces]:
    """At most so many vertices, or as few as its pieces can have.

    Edges collapse into one of their ends, those first that move the surface least (Garland and
    Heckbert, Surface simplification using quadric error metrics, 1997); in rounds of edges that
    have no end in common.

    Args:
        vertices: ``[V, 3]``.
        faces: ``[F, 3]``; seams are closed.
        most: vertices that are left.
    """
    welded = weld(vertices, faces)
    x, faces = welded.vertices, _proper(welded.faces)
    quadric = _quadrics(x, faces)
    count = len(np.unique(faces))
    while count > most:
        edges = edges_of(faces)
        ends = np.stack([edges, edges[:, ::-1]])
        cost = _cost((quadric[edges[:, 0]] + quadric[edges[:, 1]])[None], x[ends[..., 1]])
        to = ends[cost.argmin(axis=0), np.arange(len(edges))]
        chosen = _apart(to, cost.min(axis=0), len(x))[
            : max(min(count - most, int(ROUND * count)), 1)
        ]
        gone, kept = to[chosen].T
        np.add.at(quadric, kept, quadric[gone])
        at = np.arange(len(x))
        at[gone] = kept
        faces = _proper(at[faces])
        left = len(np.unique(faces))
        if left == count or not len(faces):
            break
        count = left
    used, corners = np.unique(faces, return_inverse=True)
    return x[used], corners.reshape(-1, 3)


def _proper(faces: Faces) -> Faces:
    """Those with three corners."""
    a, b, c = faces.T
    kept: Faces = faces[(a != b) & (b != c) & (c != a)]
    return kept


def _quadrics(x: Array, faces: Faces) -> Array:
    """``[V, 4, 4]`` summed squared distances from the planes of a vertex' faces, by area."""
    cross = face_crosses(x, faces)
    area = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(area, np.finfo(float).tiny)[:, None]
    quadric = np.zeros((len(x), 4, 4))
    for corner in faces.T:
        plane = np.concatenate([normal, -(normal * x[corner]).sum(axis=1)[:, None]], axis=1)
        np.add.at(quadric, corner, area[:, None, None] * plane[:, :, None] * plane[:, None, :])
        place = np.zeros((len(faces), 4, 4))
        place[:, range(3), range(3)] = 1.0
        place[:, 3, :3] = place[:, :3, 3] = -x[corner]
        place[:, 3, 3] = (x[corner] ** 2).sum(axis=1)
        np.add.at(quadric, corner, SPREAD * area[:, None, None] * place)
    return quadric


def _cost(quadric: Array, points: Array) -> Array:
    """Of ``points [..., 3]`` under ``[..., 4, 4]``."""
    homogeneous = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)
    cost: Array = np.einsum("...i,...ij,...j->...", homogeneous, quadric, homogeneous)
    return cost


def _apart(edges: Faces, cost: Array, count: int) -> NDArray[np.int64]:
    """Which of ``edges [E, 2]`` are the cheapest of both of their ends, cheapest first."""
    order = np.argsort(cost, kind="stable")
    rank = np.empty(len(edges), np.int64)
    rank[order] = np.arange(len(edges))
    least = np.full(count, len(edges))
    for end in edges.T:
        np.minimum.at(least, end, rank)
    own = (least[edges] == rank[:, None]).all(axis=1)
    chosen: NDArray[np.int64] = order[own[order]]
    return chosen
