"""Meshes that detailed shapes are put together from: rounded slabs, tubes along a path, bars."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Mesh = tuple[Array, Faces]


def lattice_surface(occupied: NDArray[np.bool_]) -> tuple[Faces, Faces]:
    """Boundary of the occupied cells: ``[n, 3]`` lattice nodes and ``[m, 3]`` triangles."""
    filled = np.pad(occupied, 1)
    corners: list[Faces] = []
    for axis in range(3):
        u, v = np.eye(3, dtype=np.int64)[[(axis + 1) % 3, (axis + 2) % 3]]
        step = np.diff(filled.astype(np.int8), axis=axis)
        for value, square in ((-1, [0 * u, u, u + v, v]), (1, [0 * u, v, u + v, u])):
            cell = np.argwhere(step == value) - 1
            cell[:, axis] += 1
            corners.append(cell[:, None] + np.array(square))
    quads = np.concatenate(corners)
    nodes, index = np.unique(quads.reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    return nodes, np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])


@cache
def cube(cells: tuple[int, int, int], rim: int) -> tuple[Array, Array, Faces]:
    """A rounded cube: inner coordinates in [-1, 1]^3, outward directions, triangles."""
    nodes, faces = lattice_surface(np.ones([count + 2 * rim for count in cells], bool))
    count = np.array(cells)
    inner = np.clip((nodes - rim) / count, 0.0, 1.0) * 2.0 - 1.0
    outer = (np.minimum(nodes - rim, 0) + np.maximum(nodes - rim - count, 0)) / rim
    outer = np.sin(outer * np.pi / 4) / np.sin(np.pi / 4)
    return inner, outer / np.linalg.norm(outer, axis=1, keepdims=True), faces


def slab(center: ArrayLike, size: ArrayLike, fillet: float, density: int) -> Mesh:
    """A box with rounded edges of a fixed radius; a cell for about each 8 cm / density."""
    cells = (4 * density, 2 * density, 4 * density)
    inner, outer, faces = cube(cells, 3)
    half = np.asarray(size) / 2.0
    radius = np.minimum(fillet, 0.45 * half.min())
    return np.asarray(center) + inner * (half - radius) + outer * radius, faces


def tube(path: Array, half: Array, sides: int, square: bool) -> Mesh:
    """A closed tube along ``path [n, 3]`` with half sections ``half [n, 2]``, across the two axes
    that the path mostly does not run along."""
    run = int(np.abs(path[-1] - path[0]).argmax())
    across = [axis for axis in range(3) if axis != run]
    angle = (np.arange(sides) + 0.5) * 2.0 * np.pi / sides
    section = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if square:
        section /= np.linalg.norm(section, ord=6, axis=1, keepdims=True)
    rings = np.repeat(path[:, None], sides, axis=1)
    rings[:, :, across] += section * half[:, None]
    i = np.arange(sides)
    j = (i + 1) % sides
    start = np.arange(len(path) - 1)[:, None] * sides
    a, b, c, d = (x.ravel() for x in (start + i, start + j, start + sides + j, start + sides + i))
    end = len(path) * sides
    last = end - sides
    caps = [np.stack([0 * i + end, j, i], 1), np.stack([0 * i + end + 1, last + i, last + j], 1)]
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1), *caps])
    forward = path[-1, run] > path[0, run]
    if forward == (run == 1):
        faces = faces[:, ::-1]
    return np.concatenate([rings.reshape(-1, 3), path[[0, -1]]]), faces


def bar(start: ArrayLike, end: ArrayLike, half: ArrayLike, density: int, square: bool) -> Mesh:
    s = np.linspace(0.0, 1.0, 5 * density + 1)[:, None]
    path = np.asarray(start) * (1 - s) + np.asarray(end) * s
    return tube(path, np.broadcast_to(np.asarray(half), (len(s), 2)), 6 * density, square)


def join(pieces: list[Mesh]) -> Mesh:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
    faces = [face + offset for (_, face), offset in zip(pieces, offsets[:-1], strict=True)]
    return np.concatenate([vertices for vertices, _ in pieces]), np.concatenate(faces)
