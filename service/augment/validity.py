"""Whether an edit leaves a mesh whole, relative to the mesh before it.

Four figures: faces that turn inside out; faces that collapse; pairs of faces that newly run through
each other, within a piece or of two that were apart (pieces that touch, or stick in each other, may
do so more deeply: that is how they are joined); and pairs of pieces that
touched and are apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.augment.contacts import Contacts
from service.augment.crossings import Crossings
from service.deform.weld import Welded, weld
from service.edited import Moved
from service.inference import Inference
from service.stages import stage

Array = NDArray[np.float64]
Index = NDArray[np.int64]

THIN = 1e-6
"""Height, as a share of the mesh's diagonal, under which a face is degenerate."""
PER = 10_000
"""Faces that crossings are told per."""


@dataclass(frozen=True)
class Limits:
    """How much of a mesh an edit may spoil.

    Attributes:
        flips, degenerate: shares of the faces.
        crossings: new pairs of crossing faces per 10,000 faces.
        gaps: pairs of pieces that have come apart.
    """

    flips: float = 1e-3
    degenerate: float = 1e-3
    crossings: float = 10.0
    gaps: int = 0


USUAL = Limits()


@dataclass(frozen=True)
class Damage:
    """What an edit does to a mesh of ``faces`` faces."""

    flipped: int
    degenerate: int
    crossings: float
    gaps: int
    faces: int

    @property
    def figures(self) -> dict[str, float]:
        """The same by name, as manifests tell them."""
        return {
            "flipped_faces": self.flipped,
            "degenerate_faces": self.degenerate,
            "new_crossings_per_10k": self.crossings,
            "opened_gaps": self.gaps,
        }

    def beyond(self, limits: Limits) -> list[str]:
        """What is over the limits, in words."""
        found = []
        if self.flipped > limits.flips * self.faces:
            found.append(f"{self.flipped} of {self.faces} faces turn inside out")
        if self.degenerate > limits.degenerate * self.faces:
            found.append(f"{self.degenerate} of {self.faces} faces collapse")
        if self.crossings > limits.crossings:
            found.append(f"{self.crossings:.1f} more pairs of faces per {PER} cross each other")
        if self.gaps > limits.gaps:
            found.append(f"{self.gaps} pairs of pieces that touched come apart")
        return found


class Validity:
    """A mesh before edits, and all that can be told beforehand."""

    def __init__(self, vertices: Array, faces: Index, welded: Welded | None = None) -> None:
        """
        Args:
            vertices: ``[V, 3]`` of the mesh.
            faces: ``[F, 3]``.
            welded: the mesh without its seams, if that is known.
        """
        self._welded = welded = weld(vertices, faces) if welded is None else welded
        own = vertices[welded.rows]
        self._heights = heights(own, welded.faces)
        self._piece = welded.piece[welded.faces[:, 0]]
        self._crossings = Crossings(own, welded.faces)
        self._contacts = Contacts.of(own, welded.faces, self._piece)
        self._before = self._counts(self._crossings.pairs(own))
        # However little: what is joined may be so more deeply.
        self._joined = {tuple(pair) for pair in self._contacts.pairs.tolist()}
        self._joined |= {
            pair for pair in self._counts(self._crossings.pairs(own, 0.0)) if len({*pair}) > 1
        }

    @classmethod
    def of(cls, found: Inference) -> Validity:
        """Of an upload."""
        with stage("bind"):
            return cls(found.mesh.vertices, found.mesh.faces)

    def damage(self, moved: Moved) -> Damage:
        """What an edit does to it."""
        with stage("transfer"):
            return self.told(moved.vertices, moved.flips)

    def told(self, vertices: Array, flips: int) -> Damage:
        """What becomes of it when its vertices go to ``vertices [V, 3]``, with so many flips."""
        own, faces = vertices[self._welded.rows], self._welded.faces
        now = heights(own, faces)
        collapsed = (now < THIN) & (now < 0.5 * self._heights)
        after = self._counts(self._crossings.pairs(own))
        more = sum(
            max(count - self._before.get(pieces, 0), 0)
            for pieces, count in after.items()
            if pieces not in self._joined
        )
        return Damage(
            flips,
            int(collapsed.sum()),
            PER * more / max(len(faces), 1),
            self._contacts.opened(own, after),
            len(faces),
        )

    def _counts(self, pairs: Index) -> dict[tuple[int, int], int]:
        """How many pairs of faces there are of each two pieces."""
        pieces = np.sort(self._piece[pairs], axis=1)
        kinds, counts = np.unique(pieces, axis=0, return_counts=True)
        return {(a, b): n for (a, b), n in zip(kinds.tolist(), counts.tolist(), strict=True)}


def heights(vertices: Array, faces: Index) -> Array:
    """``[F]`` least heights of the faces, as shares of the mesh's diagonal."""
    a, b, c = (vertices[corner] for corner in faces.T)
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.linalg.norm(side, axis=1) for side in (b - a, c - b, a - c)], axis=0)
    tiny = np.finfo(float).tiny
    diagonal = max(float(np.linalg.norm(np.ptp(vertices, axis=0))), tiny)
    result: Array = doubled / np.maximum(longest, tiny) / diagonal
    return result
