"""What template parts are made of: fixed meshes inside the cube [-1/2, 1/2]^3."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Rings:
    """Sections of a unit shape, and the bounds of each.

    Attributes:
        levels: ``[k]`` where they lie along the run, ascending.
        of: ``[n]`` which one each point lies on.
        low, high: ``[k, 2]`` bounds across the run.
    """

    levels: NDArray[np.float64]
    of: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


@dataclass(frozen=True)
class UnitShape:
    """A fixed mesh whose images under a part's map are the part's possible shapes.

    Attributes:
        vertices: ``[n, 3]`` float64.
        faces: ``[m, 3]`` int64, counter-clockwise seen from outside.
        side: ``[m]`` int64, which named side each face lies on.
        sides: the names.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    side: NDArray[np.int64]
    sides: tuple[str, ...]

    def turned(self, axes: str) -> UnitShape:
        """The same with its x, y and z along other axes: ``"yzx"`` lays its x along y and so on.

        Faces still look outwards when that is a reflection.
        """
        order = ["xyz".index(axis) for axis in axes]
        vertices = np.empty_like(self.vertices)
        vertices[:, order] = self.vertices
        odd = np.linalg.det(np.eye(3)[order]) < 0.0
        return replace(self, vertices=vertices, faces=self.faces[:, ::-1] if odd else self.faces)


def rings(points: NDArray[np.float64], run: int) -> Rings:
    """The sections across the axis `run` on which the points ``[n, 3]`` lie."""
    across = np.delete(points, run, axis=1)
    levels, of = np.unique(np.round(points[:, run], 6), return_inverse=True)
    low, high = np.full((len(levels), 2), np.inf), np.full((len(levels), 2), -np.inf)
    np.minimum.at(low, of, across)
    np.maximum.at(high, of, across)
    return Rings(levels, of, low, high)
