"""What a morph target adds to the local linear maps of vertices, and so to normals and tangents."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.mesh.polygons import Indices

Array = NDArray[np.floating]
Cell = tuple[int, int]

FLAT = 2e-3
"""Radians by which a target must turn a direction to say so."""


@dataclass(frozen=True)
class Stretch:
    """``[V, 3, 3]`` matrices, of which only some entries are not zero throughout.

    Attributes:
        cells: ``[V]`` each of those entries, by row and column.
    """

    cells: Mapping[Cell, Array]

    def scaled(self, factor: float) -> Stretch:
        """A multiple."""
        return Stretch({cell: values * factor for cell, values in self.cells.items()})

    def at(self, rows: Indices | slice) -> Stretch:
        """Those of some vertices."""
        return Stretch({cell: values[rows] for cell, values in self.cells.items()})

    def touched(self) -> Indices:
        """The vertices whose matrix is not zero, in order."""
        if not self.cells:
            return np.empty(0, np.int64)
        first, *others = self.cells.values()
        mask = first != 0.0
        for values in others:
            mask |= values != 0.0
        return np.flatnonzero(mask)

    def between(self, left: Array, right: Array) -> Stretch:
        """The products ``left G right``, of ``[3, 3]`` matrices or ``[V, 3, 3]``."""
        result: dict[Cell, Array] = {}
        for (i, j), values in self.cells.items():
            for p in range(3):
                for q in range(3):
                    factor = left[..., p, i] * right[..., j, q]
                    if np.any(factor):
                        term = factor * values
                        result[p, q] = result[p, q] + term if (p, q) in result else term
        return Stretch(result)

    def turn_normals(self, normals: Array) -> Array:
        """``[V, 3]`` what to add to normals: to first order, up to their length.

        The cofactors of ``I + G`` take normals along, in which a stretch along one axis, as most
        targets are, is linear: then any weight turns them exactly.
        """
        change = np.zeros(normals.shape, np.float32)
        for (i, j), values in self.cells.items():
            if i != j:
                change[:, j] -= values * normals[:, i]
                continue
            for other in {0, 1, 2} - {i}:
                change[:, other] += values * normals[:, other]
        return noticeable(normals, change)

    def carry_tangents(self, tangents: Array) -> Array:
        """``[V, 3]`` what to add to tangents."""
        change = np.zeros(tangents.shape, np.float32)
        for (i, j), values in self.cells.items():
            change[:, i] += values * tangents[:, j]
        return noticeable(tangents, change)


def noticeable(directions: Array, change: Array) -> Array:
    """Those of the changes that turn their directions; others only make them longer."""
    (x, y, z), (u, v, w) = directions.T, change.T
    cross = (y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2
    turns = cross > FLAT**2 * (x * x + y * y + z * z) ** 2
    return np.where(turns[:, None], change, np.float32(0.0))
