"""Whether detail survives an edit (B5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

SHORT = 1e-7
"""Edges are no shorter than this to a ratio."""
SLENDER = 5.0
"""The largest cotangent of an angle: slivers would drown all else."""


def edges_of(faces: Faces) -> Faces:
    """``[E, 2]`` the edges of ``faces [F, 3]``, each once."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(ends, axis=1), axis=0)


def edge_lengths(vertices: Array, edges: Faces) -> Array:
    """``[E]`` lengths."""
    gap = vertices[edges[:, 0]] - vertices[edges[:, 1]]
    length: Array = np.maximum(np.linalg.norm(gap, axis=1), SHORT)
    return length


def edge_ratio(y: Array, truth: Array, edges: Faces) -> tuple[float, float]:
    """Mean and 99th percentile of the ratio of edge lengths to the truth's, or its inverse: 1 where
    nothing is distorted."""
    ratio = np.abs(np.log(edge_lengths(y, edges) / edge_lengths(truth, edges)))
    return float(np.exp(ratio.mean())), float(np.exp(np.quantile(ratio, 0.99)))


def laplacian(vertices: Array, faces: Faces) -> csr_array:
    """``[V, V]`` cotangent Laplacian; faces without area have no say."""
    count = len(vertices)
    rows, columns, weights = [], [], []
    for corner in range(3):
        a, b, c = (faces[:, (corner + turn) % 3] for turn in range(3))
        u, v = vertices[b] - vertices[a], vertices[c] - vertices[a]
        area = np.linalg.norm(np.cross(u, v), axis=1)
        wide = area > 1e-12
        cotangent = np.einsum("fc,fc->f", u, v) / np.where(wide, area, 1.0)
        half = np.where(wide, np.clip(cotangent, -SLENDER, SLENDER) / 2, 0.0)
        for i, j, sign in ((b, c, -1), (c, b, -1), (b, b, 1), (c, c, 1)):
            rows.append(i)
            columns.append(j)
            weights.append(sign * half)
    entries = np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))
    return csr_array(coo_array(entries, shape=(count, count)))


def laplacian_change(x: Array, y: Array, faces: Faces) -> float:
    """Mean change of the Laplacian coordinates over their mean size, by the input's weights: 0 for
    whatever only translates."""
    operator = laplacian(x, faces)
    before = operator @ x
    size = np.linalg.norm(before, axis=1).mean()
    return float(np.linalg.norm(operator @ y - before, axis=1).mean() / max(size, 1e-12))
