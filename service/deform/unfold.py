"""Local repair of the folds that an edit would press into a mesh.

Where a mesh differs from its template, neighbours may follow different parts so far apart that
the faces between them turn inside out.  The repair evens the Jacobian out right there: first over
the shortest edges of the faces that fold (slivers), then over their surroundings.  It keeps the
binding linear, and is kept itself only as far as fewer faces fold.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from service import deadline
from service.deform.binding import Binding
from service.deform.flips import flipped
from service.deform.weld import Welded, weld

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STRONG = (0.7, 1.4)
"""Edits that a bound mesh should take without folding, as factors of a parameter."""
MERGES = 5
"""Rounds of evening out along short edges."""
RELAXATIONS = 30
"""Rounds of evening out around folds; each reaches one ring of vertices further."""
SWEEPS = 15
"""Averaging steps a round."""
FARTHEST = 0.03
"""Normalised length by which a repair may move a vertex along an axis in a strong edit."""
RINGS = 32
"""Rings of faces around folds within which a repair may move anything."""


def unfold(
    binding: Binding, vertices: Array, faces: Index, f: Array, parameters: Sequence[int]
) -> Binding:
    """The binding with fewer folds.

    Args:
        binding: of the mesh.
        vertices: ``[V, 3]`` of the mesh, in the frame that it was bound in.
        faces: ``[F, 3]``.
        f: ``[d]`` parameters that it was bound at.
        parameters: indices of those to look after.
    """
    jacobian = binding.jacobian
    welded: Welded | None = None
    for index in parameters:
        deadline.check()
        changes = [np.where(np.arange(len(f)) == index, (k - 1) * f, 0.0) for k in STRONG]
        maps = [binding.linear(change) for change in changes]
        folded = np.zeros(len(faces), bool)
        for change, map_ in zip(changes, maps, strict=True):
            folded |= flipped(vertices, vertices + binding.displace(change), faces, map_)
        if not folded.any():
            continue
        welded = welded or weld(vertices, faces)
        patch = _Patch.around(welded, folded)
        at = np.zeros(len(welded.vertices), np.int64)
        at[welded.of] = np.arange(len(vertices))
        rows = at[patch.vertex]
        folds = _Folds(patch, [float(change[index]) for change in changes], [m[rows] for m in maps])
        repaired = jacobian[at, :, index]
        repaired[patch.vertex] = _repaired(folds, repaired[patch.vertex].astype(np.float64))
        jacobian = jacobian.copy() if jacobian is binding.jacobian else jacobian
        jacobian[:, :, index] = repaired[welded.of]
    return replace(binding, jacobian=jacobian)


@dataclass(frozen=True)
class _Patch:
    """The part of a welded mesh that lies around some of its faces.

    Attributes:
        vertices, faces: of the patch.
        vertex: ``[n]`` which vertex of the whole each is.
        inner: ``[n]`` bool, those all of whose faces are in the patch: only they may move.
    """

    vertices: Array
    faces: Index
    vertex: Index
    inner: NDArray[np.bool_]

    @classmethod
    def around(cls, welded: Welded, folded: NDArray[np.bool_]) -> _Patch:
        """The faces within `RINGS` rings of the folded ones."""
        inner = np.zeros(len(welded.vertices), bool)
        touched: NDArray[np.bool_] = folded
        for _ in range(RINGS):
            inner[welded.faces[touched].ravel()] = True
            touched = np.asarray(inner[welded.faces].any(axis=1))
        faces = welded.faces[touched]
        vertex, local = np.unique(faces, return_inverse=True)
        return cls(welded.vertices[vertex], local.reshape(-1, 3), vertex, inner[vertex])

    @cached_property
    def edges(self) -> Index:
        """``[F, 3, 2]`` the ends of each face's sides."""
        return np.stack([self.faces, self.faces[:, [1, 2, 0]]], axis=2)

    @cached_property
    def shortest(self) -> Index:
        """``[F, 2]`` the ends of each face's shortest side."""
        ends = self.vertices[self.edges]
        lengths = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=2)
        return self.edges[np.arange(len(self.faces)), lengths.argmin(axis=1)]

    @cached_property
    def averaging(self) -> csr_array:
        """``[n, n]`` each vertex to the mean of its neighbours."""
        ends = self.edges.reshape(-1, 2)
        ends = np.concatenate([ends, ends[:, ::-1]])
        count = len(self.vertices)
        graph = csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
        graph.data[:] = 1.0
        degree = np.asarray(graph.sum(axis=1)).ravel()
        return graph.multiply(1.0 / np.maximum(degree, 1.0)[:, None]).tocsr()


@dataclass(frozen=True)
class _Folds:
    """Which faces fold for one parameter's strong edits.

    Attributes:
        patch: of the mesh.
        steps: the parameter's changes.
        maps: ``[n, 3, 3]`` local linear maps of each.
    """

    patch: _Patch
    steps: list[float]
    maps: list[NDArray[np.floating]]

    def __call__(self, column: Array) -> tuple[int, NDArray[np.bool_]]:
        """The most faces that one edit folds, and ``[F]`` those that either does."""
        x, faces = self.patch.vertices, self.patch.faces
        folded = [
            flipped(x, x + step * column, faces, maps)
            for step, maps in zip(self.steps, self.maps, strict=True)
        ]
        return max(int(mask.sum()) for mask in folded), np.logical_or(*folded)


def _repaired(folds: _Folds, column: Array) -> Array:
    """The candidate for a Jacobian's ``column [n, 3]`` that folds the fewest faces."""
    best, (least, folded) = column, folds(column)
    reach = FARTHEST / max(abs(step) for step in folds.steps)
    for repair in (_merged, _relaxed):
        for candidate, count in repair(folds, column, folded, reach):
            deadline.check()
            if count < least:
                best, least = candidate, count
            if least == 0:
                return best
    return best


def _merged(
    folds: _Folds, column: Array, folded: NDArray[np.bool_], reach: float
) -> Iterator[tuple[Array, int]]:
    """Let the ends of folded faces' shortest edges move as one, round after round."""
    patch, size = folds.patch, len(column)
    pairs = np.empty((0, 2), np.int64)
    for _ in range(MERGES):
        short = patch.shortest[folded]
        pairs = np.concatenate([pairs, short[patch.inner[short].all(axis=1)]])
        graph = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
        label = connected_components(graph, directed=False)[1]
        members = np.bincount(label)
        means = [np.bincount(label, values) / members for values in column.T]
        candidate = np.clip(np.stack(means, axis=1)[label], column - reach, column + reach)
        count, folded = folds(candidate)
        yield candidate, count


def _relaxed(
    folds: _Folds, column: Array, folded: NDArray[np.bool_], reach: float
) -> Iterator[tuple[Array, int]]:
    """Average over the neighbours in a region around the folds that grows each round."""
    patch = folds.patch
    region = np.zeros(len(column), bool)
    candidate = column
    for _ in range(RELAXATIONS):
        region[patch.faces[folded].ravel()] = True
        region |= patch.averaging @ region.astype(np.float64) > 0.0
        rows = np.flatnonzero(region & patch.inner)
        local = patch.averaging[rows]
        candidate = candidate.copy()
        for _ in range(SWEEPS):
            candidate[rows] = local @ candidate
        candidate = np.clip(candidate, column - reach, column + reach)
        count, folded = folds(candidate)
        yield candidate, count
