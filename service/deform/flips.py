"""Faces that an edit turned inside out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NEGLIGIBLE = 1e-4
"""Faces smaller than this share of the mean area have no direction worth counting."""


def flipped(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    maps: NDArray[np.floating],
) -> NDArray[np.bool_]:
    """``[F]`` faces of some area whose normal turns against their old one carried by the maps.

    Args:
        before, after: ``[V, 3]`` positions.
        faces: ``[F, 3]``.
        maps: ``[V, 3, 3]`` local linear maps of the edit.
    """
    a, b, c = faces.T
    origin = before[a]
    sides = before[b] - origin, before[c] - origin
    size = np.linalg.norm(np.cross(*sides), axis=1)
    mean = (maps[a] + maps[b] + maps[c]) / 3.0
    carried = np.cross(*(np.einsum("fij,fj->fi", mean, side) for side in sides))
    origin = after[a]
    normal = np.cross(after[b] - origin, after[c] - origin)
    against = np.einsum("fi,fi->f", carried, normal) < 0.0
    return against & (size > NEGLIGIBLE * size.mean())


def count_flips(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    maps: NDArray[np.floating],
) -> int:
    """How many faces are `flipped`."""
    return int(flipped(before, after, faces, maps).sum())
