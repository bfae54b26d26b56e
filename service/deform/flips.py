"""Faces that an edit turned inside out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.deform.normals import face_crosses

NEGLIGIBLE = 1e-4
"""Faces smaller than this share of the mean area have no direction worth counting."""


def count_flips(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    maps: NDArray[np.floating],
) -> int:
    """Faces of some area whose normal turns against their old one carried by the linear maps.

    Args:
        before, after: ``[V, 3]`` positions.
        faces: ``[F, 3]``.
        maps: ``[V, 3, 3]`` local linear maps of the edit.
    """
    crosses = face_crosses(before, faces)
    size = np.linalg.norm(crosses, axis=1)
    carried = np.einsum("fij,fj->fi", _cofactors(maps[faces].mean(axis=1)), crosses)
    turned = np.einsum("fi,fi->f", carried, face_crosses(after, faces)) < 0.0
    return int((turned & (size > NEGLIGIBLE * size.mean())).sum())


def _cofactors(maps: NDArray[np.floating]) -> NDArray[np.floating]:
    """Maps of area vectors: ``det(M) M^-T``, defined for singular maps too."""
    a, b, c = maps[..., 0], maps[..., 1], maps[..., 2]
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
