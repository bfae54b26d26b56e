"""Whether an edit leaves a mesh whole (`B6`: relative to the mesh before it)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.edited import Moved
from service.inference import Inference

Array = NDArray[np.float64]
Index = NDArray[np.int64]

THIN = 1e-6
"""Height, as a share of the mesh's diagonal, under which a face is degenerate."""


@dataclass(frozen=True)
class Limits:
    """How much of a mesh an edit may spoil.

    Attributes:
        flips, degenerate: shares of the faces.
    """

    flips: float = 1e-3
    degenerate: float = 1e-3


USUAL = Limits()


@dataclass(frozen=True)
class Damage:
    """What an edit does to a mesh.

    Attributes:
        figures: by name.
        faces: how many the mesh has.
    """

    figures: dict[str, float]
    faces: int

    def beyond(self, limits: Limits) -> list[str]:
        """What is over the limits, in words."""
        found = []
        if self.figures["flipped_faces"] > limits.flips * self.faces:
            found.append(f"{self.figures['flipped_faces']} of {self.faces} faces turn inside out")
        if self.figures["degenerate_faces"] > limits.degenerate * self.faces:
            found.append(f"{self.figures['degenerate_faces']} of {self.faces} faces collapse")
        return found


@dataclass(frozen=True)
class Validity:
    """A mesh before edits, and all that can be told beforehand."""

    faces: Index
    heights: Array

    @classmethod
    def of(cls, found: Inference) -> Validity:
        """Of an upload."""
        return cls(found.mesh.faces, heights(found.mesh.vertices, found.mesh.faces))

    def damage(self, moved: Moved) -> Damage:
        """What an edit does to it."""
        now = heights(moved.vertices, self.faces)
        collapsed = (now < THIN) & (now < 0.5 * self.heights)
        return Damage(
            {"flipped_faces": moved.flips, "degenerate_faces": int(collapsed.sum())},
            len(self.faces),
        )


def heights(vertices: Array, faces: Index) -> Array:
    """``[F]`` least heights of the faces, as shares of the mesh's diagonal."""
    a, b, c = (vertices[corner] for corner in faces.T)
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max(
        [np.linalg.norm(end - start, axis=1) for start, end in ((a, b), (b, c), (c, a))], axis=0
    )
    tiny = np.finfo(float).tiny
    diagonal = max(float(np.linalg.norm(np.ptp(vertices, axis=0))), tiny)
    result: Array = doubled / np.maximum(longest, tiny) / diagonal
    return result
