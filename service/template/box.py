"""The unit box: six grids."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.template.unitshape import UnitShape

BOX_SIDES = ("left", "right", "bottom", "top", "back", "front")
"""The sides of a box in the order of its faces: -x, +x, -y, +y, -z, +z."""


def box(cells: tuple[int, int, int]) -> UnitShape:
    """A cube of grids, one a side, that share no vertices, so that its normals stay sharp.

    Args:
        cells: number of grid cells along x, y and z.

    Returns:
        ``2 sum (a+1)(b+1)`` vertices over the pairs of axes.
    """
    vertices: list[NDArray[np.float64]] = []
    faces: list[NDArray[np.int64]] = []
    count = 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-0.5, 0.5):
            points, quads = _grid(cells[u], cells[v])
            side = np.empty((len(points), 3))
            side[:, axis] = sign
            side[:, u], side[:, v] = points.T
            vertices.append(side)
            faces.append((quads if sign > 0 else quads[:, ::-1]) + count)
            count += len(side)
    labels = np.repeat(np.arange(6), [len(f) for f in faces])
    return UnitShape(np.concatenate(vertices), np.concatenate(faces), labels, BOX_SIDES)


def _grid(columns: int, rows: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A unit square of ``columns x rows`` cells: ``[n, 2]`` points and ``[m, 3]`` triangles."""
    u, v = np.meshgrid(
        np.linspace(-0.5, 0.5, columns + 1), np.linspace(-0.5, 0.5, rows + 1), indexing="ij"
    )
    corner = np.arange((columns + 1) * (rows + 1)).reshape(columns + 1, rows + 1)
    a, b = corner[:-1, :-1].ravel(), corner[1:, :-1].ravel()
    c, d = corner[1:, 1:].ravel(), corner[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return np.stack([u.ravel(), v.ravel()], axis=1), triangles
