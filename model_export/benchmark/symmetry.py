"""Whether what is alike on both sides stays so (B8)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from model_export.benchmark.accuracy import diagonal

Array = NDArray[np.float64]
MIRROR = np.array([-1.0, 1.0, 1.0])


def asymmetry(vertices: Array) -> float:
    """Mean distance, over the diagonal, from each vertex's mirror image to the nearest vertex; the
    mirror is halfway across."""
    middle = (vertices[:, 0].min() + vertices[:, 0].max()) / 2
    centred = vertices - [middle, 0.0, 0.0]
    distance, _ = cKDTree(centred).query(centred * MIRROR)
    return float(distance.mean() / diagonal(vertices))


def added_asymmetry(x: Array, y: Array) -> float:
    """By how much an edit makes a mesh less symmetric."""
    return max(asymmetry(y) - asymmetry(x), 0.0)
