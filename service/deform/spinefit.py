"""Fits the middle of a part to the boxes round a mesh's sections."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LEVELS = 12
COLUMNS = 6
# How far a real part may stray from the fitted one, in normalised lengths.
REACH = 0.15
STIFFNESS = 0.3


@dataclass(frozen=True)
class Spine:
    """Middle of a part in its unit coordinates, on a grid over its long axes.

    Attributes:
        run: the long axis that the sections are cut across.
        wide: the other long axis, or None.
        thin: the axes whose middle is measured.
        middle: ``[LEVELS, COLUMNS or 1, len(thin)]``.
        half: ``[len(thin)]`` half the part's thickness as the mesh has it.
    """

    run: int
    wide: int | None
    thin: tuple[int, ...]
    middle: Array
    half: Array

    def shift(self, u: NDArray[np.float32]) -> NDArray[np.float32]:
        """``[n, len(thin)]`` middle at the long coordinates of ``u [n, 3]``, bilinear."""
        i, s = _cell(u[:, self.run], LEVELS)
        if self.wide is not None:
            j, r = _cell(u[:, self.wide], COLUMNS)
        columns = self.middle.shape[1]
        shift = np.empty((len(self.thin), len(u)), np.float32)
        for row, grid in zip(shift, self.middle.T.astype(np.float32), strict=True):
            levels = np.ascontiguousarray(grid.T).ravel()

            def at(start: Index, levels: NDArray[np.float32] = levels) -> NDArray[np.float32]:
                return levels[start] * (1 - s) + levels[start + columns] * s

            if self.wide is None:
                row[:] = at(i)
            else:
                start = i * columns + j
                row[:] = at(start) * (1 - r) + at(start + 1) * r
        return shift.T


def centers(count: int) -> Array:
    return (np.arange(count) + 0.5) / count - 0.5


def _cell(u: NDArray[np.float32], count: int) -> tuple[Index, NDArray[np.float32]]:
    """The cell of each coordinate and the place in it; straight on to the part's very ends."""
    at = np.clip((u + np.float32(0.5)) * np.float32(count) - np.float32(0.5), -0.5, count - 0.5)
    start = np.clip(np.floor(at), 0, count - 2)
    return start.astype(np.int64), at - start


def fit_spine(
    cells: Index, box: Array, size: Array, run: int, wide: int | None, thin: tuple[int, ...]
) -> Spine | None:
    """The spine through the sections that most agree with each other and with the part's size."""
    columns = COLUMNS if wide is not None else 1
    across = size[list(thin)]
    center, extent = box.mean(axis=1), box[:, 1] - box[:, 0]
    merit = np.exp(-np.abs(np.log(extent)).sum(axis=1))
    near = np.linalg.norm(center * across, axis=1) < REACH
    cells, center, extent, merit = cells[near], center[near], extent[near], merit[near]
    if len(np.unique(cells[:, 0])) < 2:
        return None
    middle = _straight_line(cells, center * across, merit, columns) / across
    for width in (0.02, 0.015, 0.015):
        off = np.linalg.norm((center - middle[cells[:, 0], cells[:, 1]]) * across, axis=1)
        chosen, weight = _choose(cells, merit * np.exp(-((off / width) ** 2)), columns)
        if np.count_nonzero(weight) < 0.15 * weight.size:
            return None
        target = np.zeros((*weight.shape, len(thin)))
        target[tuple(cells[chosen].T)] = center[chosen]
        middle = _smooth(target, weight)
    half = 0.5 * np.quantile(extent[chosen], 0.9, axis=0)
    return Spine(run, wide, thin, middle, half)


def _straight_line(cells: Index, center: Array, merit: Array, columns: int) -> Array:
    """The best of the lines through two sections each: ``[LEVELS, columns, thin]``.

    A line scores, for each cell of the grid, the merit of the section that is nearest to it.
    """
    best = np.argsort(-merit)[:60]
    first, second = (best[n] for n in np.triu_indices(len(best), 1))
    rise = cells[second, 0] - cells[first, 0]
    first, second, rise = first[rise != 0], second[rise != 0], rise[rise != 0]
    slope = (center[second] - center[first]) / rise[:, None]
    base = center[first] - slope * cells[first, :1]
    # The level line at the fitted place is always among the candidates.
    steep = np.abs(slope * LEVELS).max(axis=1) > 2 * REACH
    slope[steep], base[steep] = 0.0, 0.0
    slope, base = (np.concatenate([a, np.zeros((1, a.shape[1]))]) for a in (slope, base))
    line = base[:, None] + slope[:, None] * cells[None, :, :1]
    off = np.linalg.norm(line - center, axis=2)
    score = merit * np.exp(-((off / 0.02) ** 2))
    total = _support(score, cells, columns)
    # Of lines that fit alike, the one nearest to the fitted part.
    total -= 0.02 * LEVELS * np.linalg.norm(base + slope * LEVELS / 2, axis=1) / REACH
    top = int(total.argmax())
    levels = base[top] + slope[top] * np.arange(LEVELS)[:, None]
    return np.repeat(levels[:, None], columns, axis=1)


def _support(score: Array, cells: Index, columns: int) -> Array:
    """``[lines]`` sums over the levels: a post or two count half as much as a full panel."""
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    key = (cells[:, 0] * columns + cells[:, 1])[order]
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    cell = np.maximum.reduceat(score[:, order], starts, axis=1)
    rows = np.flatnonzero(np.diff(cells[order][starts, 0], prepend=-1))
    most = np.maximum.reduceat(cell, rows, axis=1).sum(axis=1)
    support: Array = 0.5 * most + 0.5 * cell.sum(axis=1) / columns
    return support


def _choose(cells: Index, merit: Array, columns: int) -> tuple[Index, Array]:
    """The best section of each cell, if any is good, and their weights on the grid."""
    order = np.argsort(merit)
    weight = np.zeros((LEVELS, columns))
    winner = np.full((LEVELS, columns), -1)
    weight[tuple(cells[order].T)] = merit[order]
    winner[tuple(cells[order].T)] = order
    weight[weight < 0.05] = 0.0
    return winner[weight > 0.0], weight


def _smooth(middle: Array, weight: Array) -> Array:
    """The smooth surface through the measured cells that passes straight over the others."""
    system = np.diag(weight.ravel()) + _roughness(*weight.shape)
    target = (weight[..., None] * middle).reshape(weight.size, -1)
    return np.asarray(np.linalg.solve(system, target)).reshape(middle.shape)


@cache
def _roughness(rows: int, columns: int) -> Array:
    """The quadratic form that tells how much a surface on the grid bends, and a little how much it
    rises."""
    bend = [np.kron(_second(rows), np.eye(columns)), np.kron(np.eye(rows), _second(columns))]
    step = [np.kron(_first(rows), np.eye(columns)), np.kron(np.eye(rows), _first(columns))]
    terms = [STIFFNESS * d.T @ d for d in bend] + [0.01 * d.T @ d for d in step]
    return np.asarray(sum(terms))


def _first(count: int) -> Array:
    return np.diff(np.eye(count), axis=0)


def _second(count: int) -> Array:
    return np.diff(np.eye(count), n=2, axis=0) if count > 2 else np.zeros((1, count))
