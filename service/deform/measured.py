"""Where a mesh's own surface lies: a level that a template file says how to measure.

What a hand would measure as the height of a seat is the surface at its middle, cushion included.
The template's fit knows about where that is; the mesh knows exactly.  Plumb lines fall over the
middle of the part's upper face, and where each first meets the mesh, from a little above the
template's face to a little below, is a height.  The faces' winding plays no role: real meshes have
faces that look both ways, or the wrong one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

LINES = 13
"""Plumb lines along each side of the middle."""
MIDDLE = 0.15
"""Half of the middle's share of the part's size: at the middle, rims and bolsters are far."""
BAND = 0.12
"""How far above and below the template's face the mesh's surface is looked for, in the normalised
frame."""
COVERED = 0.5
"""Least share of the lines that must meet the mesh: slats and canes may let some through."""
UNEVEN = 0.04
"""Most by which the middle half of the heights may differ, in the normalised frame."""
CHUNK = 1 << 21
"""Pairs of lines and faces that are looked at at once."""


@dataclass(frozen=True)
class Level:
    """A level of a mesh: the weighted mean height of points on its faces, which move with it.

    Attributes:
        vertices: ``[n]`` indices of vertices, some more than once.
        weights: ``[n]``, with the sum 1.
    """

    vertices: NDArray[np.int64]
    weights: Array

    def of(self, values: NDArray[np.floating]) -> Array:
        """``[...]`` the mean of the vertices' values ``[V, ...]``."""
        mean: Array = np.tensordot(self.weights, values[self.vertices], axes=1)
        return mean


def find_levels(
    vertices: Array, faces: NDArray[np.int64], template: AffineTemplate, f: Array, t: Array
) -> Mapping[str, Level]:
    """The levels that the template's derived dimensions are measured at, by dimension.

    Args:
        vertices: ``[V, 3]`` in the normalised canonical frame.
        faces: ``[F, 3]``.
        template: the variant that was fitted.
        f, t: ``[d]`` its parameters and ``[3]`` its origin.

    Returns:
        Those that can be measured well: the surface is there, and about even.
    """
    found = {}
    for name, dimension in template.derived.items():
        if dimension.on is not None and dimension.on in template.parts:
            part = template.parts.index(dimension.on)
            level = _level(vertices, faces, *_face(template, f, t, part))
            if level is not None:
                found[name] = level
    return found


def _face(template: AffineTemplate, f: Array, t: Array, part: int) -> tuple[Array, Array]:
    """``[3]`` the middle of a part's upper face and ``[2]`` the face's size along x and z."""
    u = np.zeros((5, len(template.parts), 3))
    u[:, part] = [[0, 0.5, 0], [-0.5, 0.5, 0], [0.5, 0.5, 0], [0, 0.5, -0.5], [0, 0.5, 0.5]]
    middle, left, right, rear, front = template.maps(f).place(u)[:, part] + t
    return middle, np.abs([right[0] - left[0], front[2] - rear[2]])


def _level(vertices: Array, faces: NDArray[np.int64], middle: Array, size: Array) -> Level | None:
    ticks = MIDDLE * ((2 * np.arange(LINES) + 1) / LINES - 1.0)
    x, z = (middle[[0, 2], None] + size[:, None] * ticks).tolist()
    near = _near(vertices, faces, np.array(x), np.array(z), middle[1])
    lines = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    height, face, corners = _first(vertices, faces[near], lines, middle[1])
    met = np.flatnonzero(face >= 0)
    if len(met) < COVERED * len(lines):
        return None
    # The mean of the middle half: what stands on a seat or is sunk into it does not count.
    met = met[np.argsort(height[met], kind="stable")]
    kept = met[len(met) // 4 : len(met) - len(met) // 4]
    if height[kept[-1]] - height[kept[0]] > UNEVEN:
        return None
    return Level(faces[near[face[kept]]].ravel(), corners[kept].ravel() / len(kept))


def _near(
    vertices: Array, faces: NDArray[np.int64], x: Array, z: Array, level: float
) -> NDArray[np.intp]:
    """The faces that reach into the band and over any of the lines at ``x`` and ``z``."""
    low, high = _span(vertices, faces, 1)
    rows = np.flatnonzero((high >= level - BAND) & (low <= level + BAND))
    for axis, ticks in ((0, x), (2, z)):
        low, high = _span(vertices, faces[rows], axis)
        first = np.searchsorted(ticks, low)
        rows = rows[first < np.searchsorted(ticks, high, side="right")]
    return rows


def _span(vertices: Array, faces: NDArray[np.int64], axis: int) -> tuple[Array, Array]:
    """``[F]`` and ``[F]`` between which coordinates each face lies."""
    along = np.ascontiguousarray(vertices[:, axis])
    a, b, c = (along[faces[:, corner]] for corner in range(3))
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _first(
    vertices: Array, faces: NDArray[np.int64], lines: Array, level: float
) -> tuple[Array, NDArray[np.intp], Array]:
    """The highest point of the faces in the band on each of the lines ``[n, 2]``.

    Returns:
        ``[n]`` its height, ``[n]`` its face, or -1 where there is none, and ``[n, 3]`` the weights
        of that face's corners.
    """
    height, face = np.full(len(lines), -np.inf), np.full(len(lines), -1)
    corners = np.zeros((len(lines), 3))
    step = max(CHUNK // len(lines), 1)
    every = np.arange(len(lines))
    for start in range(0, len(faces), step):
        a, b, c = (vertices[faces[start : start + step, corner]] for corner in range(3))
        weights = [_turn(b, c, lines), _turn(c, a, lines), _turn(a, b, lines)]
        total = weights[0] + weights[1] + weights[2]
        total[total == 0.0] = np.nan
        for weight in weights:
            weight /= total
        y = weights[0] * a[:, 1] + weights[1] * b[:, 1] + weights[2] * c[:, 1]
        inside = (weights[0] >= 0.0) & (weights[1] >= 0.0) & (weights[2] >= 0.0)
        y[~(inside & (np.abs(y - level) <= BAND))] = -np.inf
        best = y.argmax(axis=1)
        higher = y[every, best] > height
        height[higher] = y[every, best][higher]
        face[higher] = start + best[higher]
        corners[higher] = np.stack([weight[every, best] for weight in weights], axis=1)[higher]
    return height, face, corners


def _turn(a: Array, b: Array, lines: Array) -> Array:
    """``[n, f]`` twice the signed area, seen along y, of each line with edges ``a b [f, 3]``."""
    dx, dz = lines[:, 0, None] - a[:, 0], lines[:, 1, None] - a[:, 2]
    area: Array = (b[:, 0] - a[:, 0]) * dz - (b[:, 2] - a[:, 2]) * dx
    return area
