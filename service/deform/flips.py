"""What tells a face that an edit turned inside out: which count, and which may have at all."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from service.deform.normals import Real

NEGLIGIBLE = 1e-4
"""Faces smaller than this share of the mean area have no direction worth counting."""
CALM = 0.5
"""A map that is a multiple of the identity but for this share of it turns no normal by more than
30 degrees: asin(0.5)."""


def counted(squared: NDArray[np.floating]) -> NDArray[np.bool_]:
    """``[F]`` faces that have a direction, by their normals' squared lengths ``[F]``."""
    least = NEGLIGIBLE * np.sqrt(squared).mean() if len(squared) else 0.0
    return np.asarray(squared > least**2)


def dot(a: NDArray[Real], b: NDArray[Real]) -> NDArray[Real]:
    """``[n]`` products of vectors ``[3, n]``."""
    product: NDArray[Real] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def wild(maps: NDArray[np.floating]) -> NDArray[np.bool_]:
    """``[V]`` vertices whose maps are not all near, to `CALM`, one multiple of the identity.

    What is near it is a convex set, so that the mean of a face's three maps is in it with them.
    """
    x, y, z = maps[:, 0, 0], maps[:, 1, 1], maps[:, 2, 2]
    low, high = np.minimum(np.minimum(x, y), z), np.maximum(np.maximum(x, y), z)
    multiple = max(0.5 * float((low + high).mean()), 0.0) if len(maps) else 0.0
    squared = np.zeros(len(maps), maps.dtype)
    for i, j in product(range(3), repeat=2):
        squared += np.square(maps[:, i, j] - multiple if i == j else maps[:, i, j])
    return np.asarray(squared >= (CALM * multiple) ** 2)
