"""Meshes as pictures: a depth buffer, so that whatever lies nearer hides what lies behind."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LIGHT = np.array([0.3, 0.6, 0.74])
DARK = 0.35
"""Brightness of what the light grazes."""
VEILED = 0.4
"""Share of a translucent surface's opacity that is left of it behind an opaque one."""
CHUNK = 1 << 21
"""Pixels of triangles' bounding boxes looked at together."""


def paint(
    corners: Array,
    colours: Array,
    opacity: Array,
    centre: Array,
    scale: float,
    size: tuple[int, int],
) -> Array:
    """Faces seen along -z, the nearest of each pixel, shaded by their normals.

    The opaque ones hide each other.  Of the translucent ones the nearest to the eye is laid over
    them, and shows through weakly where it lies behind.

    Args:
        corners: ``[F, 3, 3]`` of the triangles: to the right, up, and towards the eye.
        colours: ``[F, 3]`` from 0 to 1.
        opacity: ``[F]``.
        centre: ``[2]`` in the middle of the picture.
        scale: pixels a unit.
        size: width and height of the picture in pixels.

    Returns:
        ``[height, width, 4]`` red, green, blue and opacity, top row first.
    """
    shaded = colours * _shade(corners)[:, None]
    width, height = size
    place = np.array([scale, -scale, scale]) * (corners - [*centre, 0.0])
    place[..., :2] += np.array(size) / 2
    picture, solid = np.zeros((width * height, 4)), opacity >= 1.0
    ground = np.full(width * height, -np.inf)
    for layer in (solid, ~solid):
        which = np.flatnonzero(layer)
        depth, nearest = _nearest(place[which], size)
        seen = nearest >= 0
        face = which[nearest[seen]]
        share = opacity[face] * np.where(depth >= ground, 1.0, VEILED)[seen]
        below, kept = picture[seen], picture[seen, 3] * (1 - share)
        total = share + kept
        mixed = share[:, None] * shaded[face] + kept[:, None] * below[:, :3]
        picture[seen] = np.column_stack([mixed / np.maximum(total, 1e-9)[:, None], total])
        ground = np.maximum(ground, depth)
    return np.clip(picture, 0.0, 1.0).reshape(height, width, 4)


def _shade(corners: Array) -> Array:
    """``[F]`` brightness; both sides of a face look alike."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return np.asarray(DARK + (1 - DARK) * np.abs(normals @ LIGHT))


def _nearest(place: Array, size: tuple[int, int]) -> tuple[Array, NDArray[np.int64]]:
    """Depth of the nearest triangle at each pixel's middle, and its index; -inf and -1 for none."""
    depth = np.full(size[0] * size[1], -np.inf)
    nearest = np.full(size[0] * size[1], -1)
    for pixel, at, face in _fragments(place, size):
        order = np.lexsort([at, pixel])
        pixel, at, face = pixel[order], at[order], face[order]
        last = np.append(pixel[1:] != pixel[:-1], True)[: len(pixel)]
        pixel, at, face = pixel[last], at[last], face[last]
        nearer = at > depth[pixel]
        depth[pixel[nearer]] = at[nearer]
        nearest[pixel[nearer]] = face[nearer]
    return depth, nearest


def _fragments(
    place: Array, size: tuple[int, int]
) -> Iterator[tuple[NDArray[np.int64], Array, NDArray[np.int64]]]:
    """Pixels whose middles triangles cover, with depth and triangle of each, some at a time."""
    flat = place[..., :2]
    low = np.clip(np.ceil(flat.min(axis=1) - 0.5), 0, size).astype(np.int64)
    high = np.clip(np.floor(flat.max(axis=1) - 0.5) + 1, 0, size).astype(np.int64)
    boxes = np.maximum(high - low, 0)
    counts = boxes.prod(axis=1)
    full = np.flatnonzero(counts)
    for faces in np.split(full, np.flatnonzero(np.diff(np.cumsum(counts[full]) // CHUNK)) + 1):
        face = np.repeat(faces, counts[faces])
        first = np.cumsum(counts[faces]) - counts[faces]
        row, column = np.divmod(
            np.arange(len(face)) - np.repeat(first, counts[faces]), boxes[face, 0]
        )
        column, row = column + low[face, 0], row + low[face, 1]
        weights = _barycentric(flat[face], np.column_stack([column, row]) + 0.5)
        inside = (weights >= -1e-9).all(axis=1)
        at = np.einsum("ni,ni->n", weights[inside], place[face[inside], :, 2])
        yield (row * size[0] + column)[inside], at, face[inside]


def _barycentric(triangles: Array, points: Array) -> Array:
    """``[n, 3]`` weights of triangles' corners at points; negative for triangles seen edge-on."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    twice = _cross(b - a, c - a)
    flat = np.abs(twice) < 1e-12
    weights = np.column_stack([_cross(b - points, c - points), _cross(c - points, a - points)])
    weights /= np.where(flat, 1.0, twice)[:, None]
    weights = np.column_stack([weights, 1.0 - weights.sum(axis=1)])
    return np.where(flat[:, None], -1.0, weights)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
