"""Local repair of the folds that an edit would press into a mesh.

Where a mesh differs from its template, neighbours may follow different parts so far apart that
the faces between them turn inside out.  The repair evens the Jacobian out right there: first over
the shortest edges of the faces that fold (slivers), then over their surroundings.  It keeps the
binding linear, and is kept itself only as far as fewer faces fold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from service import deadline
from service.deform.bound import Bound, Columns
from service.deform.gradient import Gradient
from service.deform.patch import Patch, Patches
from service.deform.turning import Turning
from service.deform.weld import Welded

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

STRONG = (0.7, 1.4)
"""Edits that a bound mesh should take without folding, as factors of a parameter."""
MERGES = 5
"""Rounds of evening out along short edges."""
RELAXATIONS = 30
"""Rounds of evening out around folds; each reaches one ring of vertices further."""
SWEEPS = 15
"""Averaging steps a round."""
HOPELESS = (15, 20)
"""After so many rounds, so many times more folds than at best: no repair has recovered from it."""
FARTHEST = 0.03
"""Normalised length by which a repair may move a vertex along an axis in a strong edit."""


class Unfolding:
    """A bound mesh without its seams, where folds can be looked for and evened out."""

    def __init__(self, welded: Welded) -> None:
        self.turning = Turning(welded.vertices, welded.faces)
        self._welded = welded
        self._patches = Patches(welded)

    def flips(self, moved: NDArray[np.floating], maps: NDArray[np.floating]) -> int:
        """How many faces turn inside out as the mesh's vertices move by ``moved [V, 3]`` and turn
        by ``maps [V, 3, 3]``."""
        rows = self._welded.rows
        return len(self.turning.flipped(moved[rows], maps[rows]))

    def evened(self, bound: Bound, index: int, parameter: float) -> Columns:
        """The columns of one parameter with fewer folds; none where there are none to begin with.

        Args:
            bound: the mesh.
            index: of the parameter.
            parameter: what the mesh was bound at.
        """
        welded = self._welded
        steps = [(factor - 1.0) * parameter for factor in STRONG]
        columns = {axis: c for (axis, other), c in bound.columns.items() if other == index}
        motion = {axis: column[welded.rows] for axis, column in columns.items()}
        if not motion:
            return {}
        gradient = bound.gradients[index].of(welded.rows)
        wild = gradient.wild(parameter, [factor - 1.0 for factor in STRONG])
        folded = self.turning.folded(motion, gradient, wild, steps)
        if not folded.any():
            return {}
        patch = self._patches.around(np.asarray(folded.any(axis=0)))
        folds = _Folds(patch, tuple(motion), gradient.of(patch.vertex), wild[patch.vertex], steps)
        column = np.stack([values[patch.vertex] for values in motion.values()])
        repaired = _repaired(folds, column.astype(np.float64))
        evened = {}
        for (axis, values), better in zip(motion.items(), repaired, strict=True):
            whole = values.copy()
            whole[patch.vertex] = better
            evened[axis, index] = whole if welded.seamless else whole[welded.of]
        return evened


@dataclass(frozen=True)
class _Folds:
    """Which faces fold for one parameter's strong edits.

    Attributes:
        patch: of the mesh.
        axes: along which the parameter moves anything.
        gradient: how it changes the maps, on the patch.
        wild: ``[n]`` of `Gradient.wild`.
        steps: the parameter's changes.
    """

    patch: Patch
    axes: tuple[int, ...]
    gradient: Gradient
    wild: Mask
    steps: list[float]

    @cached_property
    def _turning(self) -> Turning:
        return Turning(self.patch.vertices, self.patch.faces)

    def __call__(self, column: Array) -> tuple[int, Mask]:
        """The most faces that one edit folds, and ``[F]`` those that either does."""
        motion = dict(zip(self.axes, column, strict=True))
        folded = self._turning.folded(motion, self.gradient, self.wild, self.steps)
        return int(folded.sum(axis=1).max()), np.asarray(folded.any(axis=0))


def _repaired(folds: _Folds, column: Array) -> Array:
    """The candidate for a Jacobian's ``column [axes, n]`` that folds the fewest faces."""
    best, (least, folded) = column, folds(column)
    reach = FARTHEST / max(abs(step) for step in folds.steps)
    for repair in (_merged, _relaxed):
        for turn, (candidate, count) in enumerate(repair(folds, column, folded, reach), start=1):
            deadline.check()
            if count < least:
                best, least = candidate, count
            if least == 0:
                return best
            if turn >= HOPELESS[0] and count > HOPELESS[1] * least:
                break
    return best


def _merged(
    folds: _Folds, column: Array, folded: Mask, reach: float
) -> Iterator[tuple[Array, int]]:
    """Let the ends of folded faces' shortest edges move as one, round after round."""
    patch, size = folds.patch, column.shape[1]
    pairs = np.empty((0, 2), np.int64)
    for _ in range(MERGES):
        short = patch.shortest[folded]
        pairs = np.concatenate([pairs, short[patch.inner[short].all(axis=1)]])
        graph = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
        label = connected_components(graph, directed=False)[1]
        members = np.bincount(label)
        means = np.stack([np.bincount(label, values) / members for values in column])
        candidate = np.clip(means[:, label], column - reach, column + reach)
        count, folded = folds(candidate)
        yield candidate, count


def _relaxed(
    folds: _Folds, column: Array, folded: Mask, reach: float
) -> Iterator[tuple[Array, int]]:
    """Average over the neighbours in a region around the folds that grows each round."""
    patch = folds.patch
    region = np.zeros(column.shape[1], bool)
    candidate = column
    for _ in range(RELAXATIONS):
        region[patch.faces[folded].ravel()] = True
        region |= patch.averaging @ region.astype(np.float64) > 0.0
        rows = np.flatnonzero(region & patch.inner)
        local = patch.averaging[rows]
        candidate = candidate.copy()
        for values in candidate:
            for _ in range(SWEEPS):
                values[rows] = local @ values
        candidate = np.clip(candidate, column - reach, column + reach)
        count, folded = folds(candidate)
        yield candidate, count
