"""Faces that run through each other after an edit, and did not before (B6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.augment.crossings import DEEP, Crossings
from service.deform.weld import weld

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Crossing:
    """What runs through what, each pair as one number.

    Attributes:
        faces: ``[m]`` pairs of faces.
        pieces: ``[m]`` the pairs of connected pieces that these belong to.
    """

    faces: Index
    pieces: Index

    def beyond(self, others: Sequence[Crossing]) -> Crossing:
        """What of it is in none of the others, pieces too."""
        fresh = [
            own[~np.isin(own, np.concatenate([getattr(other, name) for other in others]))]
            for name, own in vars(self).items()
        ]
        return Crossing(*fresh)


class Crossed:
    """Finds crossings in edits of one mesh."""

    def __init__(self, x: Array, faces: Index) -> None:
        """
        Args:
            x: ``[V, 3]`` the mesh before edits.
            faces: ``[F, 3]``; at a seam they are neighbours, as those that share a vertex are.
        """
        welded = weld(x, faces)
        self._rows, self._piece = welded.rows, welded.piece[welded.faces[:, 0]]
        self._crossings = Crossings(welded.vertices, welded.faces)
        # However little: what runs into something may do so more deeply.
        self.before = self.found(x, 0.0)

    def found(self, y: Array, deep: float = DEEP) -> Crossing:
        """In a mesh ``y [V, 3]``, by more than such a share of the diagonal."""
        pairs = self._crossings.pairs(y[self._rows], deep)
        pieces = np.sort(self._piece[pairs], axis=1)
        count = len(self._piece)
        keys = [own[:, 0] * count + own[:, 1] for own in (pairs, pieces)]
        return Crossing(*keys)
