"""Surfaces through closed sections: fuselages, wings, nacelles; and what grows out of a surface."""

from __future__ import annotations

import numpy as np

from model_export.primitives import Array, Faces, Mesh


def lofted(rings: Array) -> Mesh:
    """A closed surface through ``rings [n, m, 3]``, its ends closed to their middles, wound
    outwards."""
    count, sides = rings.shape[:2]
    grid = np.arange(count * sides).reshape(count, sides)
    after = np.roll(grid, -1, axis=1)
    a, b, c, d = (x.ravel() for x in (grid[:-1], after[:-1], after[1:], grid[1:]))
    end = grid.size
    caps = [
        np.stack([after[0], grid[0], np.full(sides, end)], 1),
        np.stack([grid[-1], after[-1], np.full(sides, end + 1)], 1),
    ]
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1), *caps])
    vertices = np.concatenate([rings.reshape(-1, 3), rings[[0, -1]].mean(axis=1)])
    return outward(vertices, faces)


def outward(vertices: Array, faces: Faces) -> Mesh:
    """The same closed surface with its faces' outer sides outside."""
    a, b, c = (vertices[faces[:, corner]] - vertices.mean(axis=0) for corner in range(3))
    inside_out = np.einsum("fc,fc->", a, np.cross(b, c)) < 0.0
    return vertices, faces[:, ::-1] if inside_out else faces


def mirrored(mesh: Mesh) -> Mesh:
    """Left for right."""
    vertices, faces = mesh
    return vertices * [-1.0, 1.0, 1.0], faces[:, ::-1]


def aerofoil(chord: int, camber: float = 0.02) -> Array:
    """``[2 chord, 2]`` of a section, across and along it: the leading edge at (0, 1/2), the
    greatest thickness 1 and the trailing edge blunt."""
    c = 0.5 - 0.5 * np.cos(np.pi * (np.arange(chord) + 0.5) / chord)
    half = 0.2969 * np.sqrt(c) - 0.1260 * c - 0.3516 * c**2 + 0.2843 * c**3 - 0.0986 * c**4
    half *= 0.5 / half.max()
    bend = 40.0 * camber * c * (1.0 - c)
    top = np.stack([bend + half, 0.5 - c], axis=1)
    bottom = np.stack([bend - half, 0.5 - c], axis=1)
    return np.concatenate([top, bottom[::-1]])


def wing(middle: Array, up: Array, chord: Array, thick: Array, outline: Array) -> Mesh:
    """A wing through sections, along +z.

    Args:
        middle: ``[n, 3]`` of the sections' middles.
        up: ``[n, 3]`` unit directions across them.
        chord, thick: ``[n]`` their sizes.
        outline: of `aerofoil`.
    """
    rings = np.repeat(middle[:, None], len(outline), axis=1)
    rings += up[:, None] * (outline[:, 0] * thick[:, None])[..., None]
    rings[..., 2] += outline[:, 1] * chord[:, None]
    return lofted(rings)


def turned(z: Array, radius: Array, center: Array, sides: int) -> Mesh:
    """A body of revolution about an axis along z through `center`; a profile may turn back into
    itself, as an engine's intake does."""
    angle = np.arange(sides) * 2.0 * np.pi / sides
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    rings = radius[:, None, None] * circle
    rings[..., 2] = z[:, None]
    return lofted(rings + center)


def outgrown(faces: Faces, block: Faces, first: int, layers: int) -> tuple[Faces, Faces, Faces]:
    """Take a patch of a surface's quads and let it grow out: walls between layers, and a cap.

    Args:
        faces: ``[Q, 4]`` quads of the surface.
        block: ``[n, m]`` the patch's vertices, row by row.
        first: index that the first new vertex takes.
        layers: of new vertices.

    Returns:
        The faces; the patch's rim ``[r]``, in the order of each layer's vertices; and the new
        vertices within the cap, ``[n - 2, m - 2]``, which come last.
    """
    rim = np.concatenate([block[0, :-1], block[:-1, -1], block[-1, :0:-1], block[:0:-1, 0]])
    count = len(rim)
    replaced = np.isin(faces, block).all(axis=1)
    layer = first + np.arange(layers * count).reshape(layers, count)
    below, above = np.concatenate([rim[None], layer[:-1]]), layer
    turn = [np.roll(ring, -1, axis=1) for ring in (below, above)]
    walls = np.stack([below, turn[0], turn[1], above], axis=2).reshape(-1, 4)
    # Walls run round as the faces that they replace do.
    patch = faces[replaced]
    starts, ends = patch.ravel(), np.roll(patch, -1, axis=1).ravel()
    if not ((starts == rim[0]) & (ends == rim[1])).any():
        walls = walls[:, ::-1]
    renamed = np.zeros(faces.max() + 1, np.int64)
    renamed[rim] = layer[-1]
    inner = block[1:-1, 1:-1]
    within = first + layers * count + np.arange(inner.size).reshape(inner.shape)
    renamed[inner] = within
    return np.concatenate([faces[~replaced], walls, renamed[patch]]), rim, within


def triangles(quads: Faces) -> Faces:
    """``[2 Q, 3]`` of ``quads [Q, 4]``."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
