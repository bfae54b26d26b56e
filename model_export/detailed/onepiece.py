"""A detailed airplane of one skin: wings and tail grow out of patches of the fuselage."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np

from model_export.detailed import skin
from model_export.detailed.lofts import aerofoil, outgrown, outward, triangles
from model_export.detailed.surfaces import (
    fin_sections,
    tail_level,
    tail_sections,
    wing_sections,
)
from model_export.primitives import Array, Faces, Mesh

Growth = tuple[slice, int, Array, Array, Array, int]
"""Rows and the first column of a patch; ``[n, 3]`` middles, chord and thickness of what grows out
of it, negative where its columns run the other way; the axis that it is thick along."""


def airplane(p: SimpleNamespace, s: SimpleNamespace) -> Mesh:
    """The whole of it."""
    wide, sides = s.density + s.density % 2, 12 * s.density
    t, *rows = _stations(s, s.density)
    rings = skin.rings(p, s, t, sides)
    grid = np.arange(len(t) * sides).reshape(len(t), sides)
    after = np.roll(grid, -1, axis=1)
    faces: Faces = np.stack([grid[:-1], after[:-1], after[1:], grid[1:]], axis=2).reshape(-1, 4)
    points = [rings.reshape(-1, 3)]
    count = grid.size
    for growth in _growths(p, s, rows, wide, sides):
        faces, new = _grow(faces, grid, wide, count, growth)
        points.append(new)
        count += len(new)
    caps = [
        np.stack([after[0], grid[0], np.full(sides, count)], 1),
        np.stack([grid[-1], after[-1], np.full(sides, count + 1)], 1),
    ]
    points.append(rings[[0, -1]].mean(axis=1))
    # What was within a patch is on no surface any more.
    used, faces = np.unique(np.concatenate([triangles(faces), *caps]), return_inverse=True)
    return outward(np.concatenate(points)[used], faces.reshape(-1, 3))


def _stations(s: SimpleNamespace, d: int) -> tuple[Array, slice, slice]:
    """Places of the sections, and those where the wing's and the tail's roots lie."""
    half = s.wing_share / 2
    tail, wing = (-0.48, -0.5 + s.fin_share), (s.station - half, s.station + half)
    nose = 0.5 - s.nose * (1.0 - np.sin(np.pi / 2 * np.arange(6 * d + 1) / (6 * d)))
    nose[-1] = 0.5 - 1e-3
    cells = [d, 5 * d, 4 * d, 6 * d, 3 * d]
    stops = [-0.5, *tail, *wing, max(nose[0], wing[1] + 0.03)]
    intervals = zip(stops[:-1], stops[1:], cells, strict=True)
    runs = [np.linspace(a, b, count, endpoint=False) for a, b, count in intervals]
    at = np.cumsum([0, *cells])
    t = np.concatenate([*runs, nose[nose >= stops[-1] - 1e-9]])
    return t, slice(at[3], at[4] + 1), slice(at[1], at[2] + 1)


def _growths(
    p: SimpleNamespace, s: SimpleNamespace, rows: list[slice], wide: int, sides: int
) -> Iterator[Growth]:
    wing_rows, tail_rows = rows
    out = np.sin(np.pi / 2 * np.arange(1, 8 * s.density + 1) / (8 * s.density))
    x, middle, chord, thick = wing_sections(p, s, out)
    # The patch is on the side, at the wing's level.
    low = round(sides * np.arcsin(np.clip(2 * s.level, -0.8, 0.8)) / (2 * np.pi)) - wide // 2
    yield wing_rows, low, np.column_stack([x, middle]), chord, thick, 1
    yield wing_rows, sides // 2 - low - wide, np.column_stack([-x, middle]), chord, -thick, 1
    x, z, chord = tail_sections(p, s, out)
    plan = np.stack([x, np.full_like(x, tail_level(p, s)[0]), z], axis=1)
    yield tail_rows, -wide // 2, plan, chord, 0.1 * chord, 1
    yield tail_rows, (sides - wide) // 2, plan * [-1.0, 1.0, 1.0], chord, -0.1 * chord, 1
    y, z, chord = fin_sections(p, s, out)
    plan = np.stack([0.0 * y, y, z], axis=1)
    yield tail_rows, sides // 4 - wide // 2, plan, chord, -0.1 * chord, 0


def _grow(faces: Faces, grid: Faces, wide: int, first: int, growth: Growth) -> tuple[Faces, Array]:
    """The faces with what grows out of a patch, and its vertices, which are counted from `first`.

    Each of its sections has the patch's rim for an outline.
    """
    rows, column, middle, chord, thick, across = growth
    block = np.roll(grid, -column, axis=1)[rows, : wide + 1]
    faces, rim, _ = outgrown(faces, block, first, len(middle))
    along, up = (
        (index / (size - 1)).ravel()
        for index, size in zip(np.indices(block.shape), block.shape, strict=True)
    )
    order = np.argsort(block.ravel())
    on_rim = order[np.searchsorted(block.ravel()[order], rim)]
    inner = np.arange(block.size).reshape(block.shape)[1:-1, 1:-1].ravel()
    sections = [
        _outline(along[on_rim], up[on_rim], m, c, h, across)
        for m, c, h in zip(middle, chord, thick, strict=True)
    ]
    cap = _outline(along[inner], up[inner], middle[-1], chord[-1], thick[-1], across)
    return faces, np.concatenate([*sections, cap])


def _outline(
    along: Array, up: Array, middle: Array, chord: float, thick: float, across: int
) -> Array:
    """Points of a section, `along` from its trailing edge at 0 to the leading edge at 1 and `up`
    from 0 on one side to 1 on the other."""
    smooth = aerofoil(64, 0.0)[63::-1]
    share = 0.5 - 0.5 * np.cos(np.pi * along)
    half = np.maximum(np.interp(share - 0.5, smooth[:, 1], smooth[:, 0]), 0.12)
    points = np.repeat(middle[None], len(along), axis=0)
    points[:, across] += thick * half * (2.0 * up - 1.0)
    points[:, 2] += chord * (share - 0.5)
    return points
