"""Faces that an edit turned inside out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.deform.normals import face_crosses

NEGLIGIBLE = 1e-4
"""Faces smaller than this share of the mean area have no direction worth counting."""
STRETCH = 3.0
"""A symmetric map whose stretches are within this factor of each other turns no normal by more
than 30 degrees: asin((3 - 1) / (3 + 1))."""


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
    normal, turned = face_crosses(before, faces), face_crosses(after, faces)
    squared = np.einsum("fi,fi->f", normal, normal)
    counted = squared > (NEGLIGIBLE * np.sqrt(squared).mean()) ** 2
    suspects = np.ones(len(faces), bool)
    if _turns_little(maps):
        # Nor has a face flipped whose own normal turned by less than the 60 degrees that remain.
        cosine = np.einsum("fi,fi->f", normal, turned)
        suspects = cosine < 0.5 * np.sqrt(squared * np.einsum("fi,fi->f", turned, turned))
    rows = np.flatnonzero(suspects & counted)
    corners = faces[rows]
    mean = maps[corners].mean(axis=1)
    origin = before[corners[:, 0]]
    sides = (before[corners[:, 1]] - origin, before[corners[:, 2]] - origin)
    carried = np.cross(*(np.einsum("fij,fj->fi", mean, side) for side in sides))
    folded = np.zeros(len(faces), bool)
    folded[rows] = np.einsum("fi,fi->f", carried, turned[rows]) < 0.0
    return folded


def _turns_little(maps: NDArray[np.floating]) -> bool:
    """Whether all maps are symmetric with stretches, by Gershgorin's bounds, within `STRETCH`."""
    above, below = maps[:, [0, 0, 1], [1, 2, 2]], maps[:, [1, 2, 2], [0, 0, 1]]
    if not np.array_equal(above, below):
        return False
    ab, ac, bc = np.abs(above).T
    diagonal = maps[:, [0, 1, 2], [0, 1, 2]]
    off = np.stack([ab + ac, ab + bc, ac + bc], axis=1)
    low, high = (diagonal - off).min(axis=1), (diagonal + off).max(axis=1)
    return bool((low > 0.0).all() and (high <= STRETCH * low).all())


def count_flips(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    maps: NDArray[np.floating],
) -> int:
    """How many faces are `flipped`."""
    return int(flipped(before, after, faces, maps).sum())
