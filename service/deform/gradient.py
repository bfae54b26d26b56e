"""How one parameter changes the local linear maps of a bound mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.flips import CALM

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Gradient:
    """The local linear maps that a unit of one parameter adds.

    Attributes:
        cells: the entries, as row and column, that are not zero throughout.
        values: ``[len(cells), n]`` of each vertex.
    """

    cells: Sequence[tuple[int, int]]
    values: Array32

    def of(self, rows: Index | slice) -> Gradient:
        """The same of some vertices."""
        return Gradient(self.cells, self.values[:, rows])

    def wild(self, parameter: float, shares: Sequence[float]) -> Mask:
        """``[n]`` vertices whose maps may turn a normal by more than 30 degrees in a step by one of
        these shares of the parameter.

        With its gradient G a parameter p that changes by the share k has the map ``I + k p G``, a
        multiple ``c = 1 + k / 2`` of the identity but for ``k (p G - I / 2)``.
        """
        at = dict(zip(self.cells, self.values, strict=True))
        squared = np.zeros(self.values.shape[1], np.float32)
        for i, j in {*self.cells, (0, 0), (1, 1), (2, 2)}:
            squared += (np.float32(parameter) * at.get((i, j), 0.0) - 0.5 * (i == j)) ** 2
        least = min(CALM * (1.0 + 0.5 * k) / abs(k) for k in shares)
        return np.asarray(squared >= least**2)

    def carried(self, corners: Index, sides: Array) -> Array:
        """``[2, 3, m]`` changes a unit of ``sides [2, 3, m]`` by the mean of the maps at the
        ``corners [3, m]`` of their faces."""
        change = np.zeros_like(sides)
        for (i, j), value in zip(self.cells, self.values, strict=True):
            a, b, c = (value[corner] for corner in corners)
            change[:, i] += (a + b + c) / 3 * sides[:, j]
        return change
