"""Faces that an edit turned inside out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.deform.normals import Real, cross, face_crosses

NEGLIGIBLE = 1e-4
"""Faces smaller than this share of the mean area have no direction worth counting."""
CALM = 0.5
"""A map that is a multiple of the identity but for this share of it turns no normal by more than
30 degrees: asin(0.5)."""


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
    normal, turned = face_crosses(before, faces).T, face_crosses(after, faces).T
    squared = dot(normal, normal)
    # Where the maps turn little, no face has flipped whose own normal turned by less than the 60
    # degrees that remain.
    suspects = dot(normal, turned) < 0.5 * np.sqrt(squared * dot(turned, turned))
    wild = _wild(maps)
    if wild.any():
        suspects |= wild[faces].any(axis=1)
    rows = np.flatnonzero(suspects & counted(squared))
    a, b, c = faces[rows].T
    mean = ((maps[a] + maps[b] + maps[c]) / 3).transpose(1, 2, 0)
    sides = ((before[end] - before[a]).T for end in (b, c))
    carried = cross(*((mean * side).sum(axis=1) for side in sides))
    folded = np.zeros(len(faces), bool)
    folded[rows] = dot(carried, turned[:, rows]) < 0.0
    return folded


def counted(squared: NDArray[np.floating]) -> NDArray[np.bool_]:
    """``[F]`` faces that have a direction, by their normals' squared lengths ``[F]``."""
    least = NEGLIGIBLE * np.sqrt(squared).mean() if len(squared) else 0.0
    return np.asarray(squared > least**2)


def dot(a: NDArray[Real], b: NDArray[Real]) -> NDArray[Real]:
    """``[n]`` products of vectors ``[3, n]``."""
    product: NDArray[Real] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def _wild(maps: NDArray[np.floating]) -> NDArray[np.bool_]:
    """``[V]`` vertices whose maps are not all near, to `CALM`, one multiple of the identity.

    What is near it is a convex set, so that the mean of a face's three maps is in it with them.
    """
    x, y, z = maps[:, 0, 0], maps[:, 1, 1], maps[:, 2, 2]
    low, high = np.minimum(np.minimum(x, y), z), np.maximum(np.maximum(x, y), z)
    multiple = max(0.5 * float((low + high).mean()), 0.0) if len(maps) else 0.0
    rest = (maps - multiple * np.eye(3, dtype=maps.dtype)).reshape(len(maps), 9)
    return np.asarray(np.einsum("vi,vi->v", rest, rest) >= (CALM * multiple) ** 2)


def count_flips(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    maps: NDArray[np.floating],
) -> int:
    """How many faces are `flipped`."""
    return int(flipped(before, after, faces, maps).sum())
