"""The surroundings of some faces of a mesh, to be evened out by themselves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from service.deform.weld import Welded

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

RINGS = 32
"""Rings of faces around folds within which a repair may move anything."""


@dataclass(frozen=True)
class Patch:
    """The part of a welded mesh that lies around some of its faces.

    Attributes:
        vertices, faces: of the patch.
        vertex: ``[n]`` which vertex of the whole each is.
        inner: ``[n]`` bool, those all of whose faces are in the patch: only they may move.
    """

    vertices: Array
    faces: Index
    vertex: Index
    inner: Mask

    @cached_property
    def edges(self) -> Index:
        """``[F, 3, 2]`` the ends of each face's sides."""
        return np.stack([self.faces, self.faces[:, [1, 2, 0]]], axis=2)

    @cached_property
    def shortest(self) -> Index:
        """``[F, 2]`` the ends of each face's shortest side."""
        squared = np.zeros((3, len(self.faces)))
        for column in self.vertices.T:
            at = [column[corner] for corner in self.faces.T]
            squared += [(at[side] - at[(side + 1) % 3]) ** 2 for side in range(3)]
        return self.edges[np.arange(len(self.faces)), squared.argmin(axis=0)]

    @cached_property
    def averaging(self) -> csr_array:
        """``[n, n]`` each vertex to the mean of its neighbours."""
        ends = self.edges.reshape(-1, 2)
        ends = np.concatenate([ends, ends[:, ::-1]]).astype(np.int32)
        count = len(self.vertices)
        graph = csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
        degree = np.diff(graph.indptr)
        graph.data = np.repeat(1.0 / np.maximum(degree, 1), degree)
        return graph


class Patches:
    """Cuts patches out of a mesh."""

    def __init__(self, welded: Welded) -> None:
        self._welded = welded

    @cached_property
    def _around(self) -> csr_array:
        """``[n, F]`` the faces at each vertex."""
        faces = self._welded.faces
        corners = faces.astype(np.int32).ravel()
        ends = np.arange(0, len(corners) + 1, 3, dtype=np.int32)
        shape = (len(faces), len(self._welded.vertices))
        return csr_array((np.ones(len(corners), np.int8), corners, ends), shape=shape).tocsc().T

    def around(self, folded: Mask) -> Patch:
        """The faces within `RINGS` rings of the folded ones ``[F]``."""
        faces = self._welded.faces
        inner, touched = np.zeros(len(self._welded.vertices), bool), folded.copy()
        ring = np.flatnonzero(folded)
        for _ in range(RINGS):
            reached = faces[ring].ravel()
            reached = np.unique(reached[~inner[reached]])
            inner[reached] = True
            ring = _listed(self._around, reached)
            ring = np.unique(ring[~touched[ring]])
            touched[ring] = True
        faces = faces[touched]
        used = np.zeros(len(inner), bool)
        used[faces] = True
        vertex = np.flatnonzero(used)
        place = np.empty(len(inner), np.int64)
        place[vertex] = np.arange(len(vertex))
        return Patch(self._welded.vertices[vertex], place[faces], vertex, inner[vertex])


def _listed(graph: csr_array, rows: Index) -> Index:
    """The columns that a graph has in any of the rows, one after another."""
    starts = graph.indptr[rows]
    counts = graph.indptr[rows + 1] - starts
    before = np.cumsum(counts) - counts
    return graph.indices[np.repeat(starts - before, counts) + np.arange(counts.sum())]
