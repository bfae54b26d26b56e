"""Unit normals of a mesh's vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]


def face_crosses(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """``[F, 3]`` face normals, twice the face's area long."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    crosses: Array = np.cross(b - a, c - a)
    return crosses


def vertex_normals(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """``[V, 3]`` area-weighted unit normals; zero for a vertex without a face of any area."""
    count = len(faces)
    at = csr_array(
        (np.ones(3 * count), (faces.T.ravel(), np.tile(np.arange(count), 3))),
        shape=(len(vertices), count),
    )
    normals: Array = at @ face_crosses(vertices, faces)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0.0, length, 1.0)
