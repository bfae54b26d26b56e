"""Points and the nearest points of triangles (Ericson, Real-Time Collision Detection, 5.1.5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TINY = np.finfo(float).tiny


def nearest_on_faces(vertices: Array, faces: Index, points: Array) -> tuple[Array, Array]:
    """Distances ``[m]`` from points to faces, one by one, and where on each it is nearest.

    Args:
        vertices: ``[n, 3]``.
        faces: ``[m, 3]``.
        points: ``[m, 3]``.

    Returns:
        The distances, and the weights ``[m, 3]`` of the faces' corners in the nearest points.
    """
    a, b, c = (vertices[corner] for corner in faces.T)
    inner, flat = _projected(a, b, c, points)
    best = np.where(inner[:, None], flat, 0.0)
    least = np.where(inner, _gap(best, a, b, c, points), np.inf)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        weights = _on_edge((a, b, c), start, end, points)
        gap = _gap(weights, a, b, c, points)
        nearer = gap < least
        best[nearer], least[nearer] = weights[nearer], gap[nearer]
    return least, best


def face_distance(vertices: Array, faces: Index, point: Array) -> float:
    """The distance from a point ``[3]`` to the nearest of ``faces [m, 3]``."""
    return float(nearest_on_faces(vertices, faces, np.broadcast_to(point, faces.shape))[0].min())


def _projected(a: Array, b: Array, c: Array, p: Array) -> tuple[NDArray[np.bool_], Array]:
    """Whether points lie above their faces, and the weights of the points below them."""
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
    wu, wv = (w * u).sum(axis=1), (w * v).sum(axis=1)
    scale = 1.0 / np.maximum(uu * vv - uv * uv, TINY)
    beta, gamma = scale * (vv * wu - uv * wv), scale * (uu * wv - uv * wu)
    weights = np.stack([1.0 - beta - gamma, beta, gamma], axis=1)
    return (weights >= 0.0).all(axis=1) & np.isfinite(weights).all(axis=1), weights


def _on_edge(corners: tuple[Array, Array, Array], start: int, end: int, p: Array) -> Array:
    along = corners[end] - corners[start]
    share = ((p - corners[start]) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), TINY)
    share = np.clip(share, 0.0, 1.0)
    weights = np.zeros((len(p), 3))
    weights[:, start], weights[:, end] = 1.0 - share, share
    return weights


def _gap(weights: Array, a: Array, b: Array, c: Array, p: Array) -> Array:
    at = weights[:, :1] * a + weights[:, 1:2] * b + weights[:, 2:] * c
    gap: Array = np.linalg.norm(at - p, axis=1)
    return gap
