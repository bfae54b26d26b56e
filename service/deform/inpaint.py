"""Values known on a part of a mesh filled in smoothly over the rest of it.

After Abdrashitov et al., Robust Skin Weights Transfer via Weight Inpainting (2023), section 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]

# Cotangents outside this range, of needles and obtuse corners, are brought into it: with positive
# ones only, what is filled in stays between what is known.
COTANGENTS = (0.05, 10.0)


def laplacian(vertices: Array, faces: NDArray[np.int64]) -> csr_array:
    """``[n, n]`` sparse, symmetric and positive semidefinite, by cotangents; rows sum to 0.

    Args:
        vertices: ``[n, 3]``.
        faces: ``[m, 3]``; they may meet in any number, and turn either way.
    """
    count = len(vertices)
    corners = vertices[faces]
    starts, ends, values = [], [], []
    for corner in range(3):
        left, right = (corner + 1) % 3, (corner + 2) % 3
        a = corners[:, left] - corners[:, corner]
        b = corners[:, right] - corners[:, corner]
        area = np.linalg.norm(np.cross(a, b), axis=1)
        dot = np.einsum("fc,fc->f", a, b)
        cotangent = np.clip(dot / np.maximum(area, 1e-30), *COTANGENTS)
        starts.append(faces[:, left])
        ends.append(faces[:, right])
        values.append(0.5 * cotangent)
    start, end, value = np.concatenate(starts), np.concatenate(ends), np.concatenate(values)
    value[start == end] = 0.0
    links = csr_array((value, (start, end)), shape=(count, count))
    links = links + links.T
    return csr_array(diags_array(links.sum(axis=1)) - links)


def fill(matrix: csr_array, known: NDArray[np.bool_], values: Array, trust: Array) -> Array:
    """``[n, c]`` values that are as given where known, and smooth elsewhere.

    They are harmonic, and so between those at the rim: weights stay positive with a sum of 1, as
    they don't with the squared operator.  Where values have some trust, they are drawn to them.

    Args:
        matrix: ``[n, n]`` of `laplacian`.
        known: ``[n]``; each connected component has one.
        values: ``[n, c]``; only rows that are known or have trust count.
        trust: ``[n]`` area around each over the square of the distance from the rim at which what
            is given counts as much as the rim does.
    """
    filled = values.copy()
    unknown = np.flatnonzero(~known)
    if not len(unknown):
        return filled
    rows = matrix[unknown]
    inner = rows[:, unknown] + diags_array(trust[unknown])
    outer = rows[:, np.flatnonzero(known)]
    factors = splu(
        inner.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    given = trust[unknown, None] * values[unknown]
    filled[unknown] = factors.solve(given - outer @ values[known])
    return filled


def smooth(matrix: csr_array, values: Array, strength: Array, steps: int) -> Array:
    """``[n, c]`` values after so many steps of averaging with the neighbours' mean.

    Args:
        matrix: ``[n, n]`` of `laplacian`.
        values: ``[n, c]``.
        strength: ``[n]`` share of that mean in a step, up to a half.
        steps: how many.
    """
    diagonal = matrix.diagonal()
    scale = np.where(diagonal > 0.0, strength / np.where(diagonal > 0.0, diagonal, 1.0), 0.0)
    step = csr_array(diags_array(np.ones(len(scale))) - diags_array(scale) @ matrix)
    for _ in range(steps):
        values = step @ values
    return values
