"""What a bound mesh keeps to be edited: what each parameter does to it, where it does anything.

A binding says it of all parameters and vertices, and takes several times the memory.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from service.deform.gradient import Gradient
from service.deform.weld import Welded

Array32 = NDArray[np.float32]

Columns = Mapping[tuple[int, int], NDArray[np.floating]]
"""``[V]`` each of ``[V, 3, d]``, by axis and parameter; what is zero throughout is left out."""


@dataclass(frozen=True)
class Bound:
    """A mesh bound to an affine template, for changes of some of the parameters.

    Attributes:
        count: of the mesh's vertices.
        columns: their displacements per unit of each parameter.
        gradients: what a unit of each parameter adds to their local linear maps.
        welded: the mesh without its seams, where that is known.
    """

    count: int
    columns: Columns
    gradients: Mapping[int, Gradient]
    welded: Welded | None = None

    def displace(self, df: ArrayLike) -> Array32:
        """Displacements ``[V, 3]`` for a change of the parameters ``df [d]``.

        Coordinates that no changed parameter moves are exactly zero.
        """
        df = np.asarray(df, np.float32)
        moved = np.zeros((3, self.count), np.float32)
        for (axis, index), column in self.columns.items():
            if df[index]:
                moved[axis] += df[index] * column
        return moved.T

    def column(self, index: int) -> Array32:
        """``[V, 3]`` displacements per unit of one parameter."""
        moved = np.zeros((3, self.count), np.float32)
        for (axis, parameter), column in self.columns.items():
            if parameter == index:
                moved[axis] = column
        return moved.T

    def linear(self, df: ArrayLike) -> Array32:
        """Local linear maps ``[V, 3, 3]`` for ``df [d]``: tangents follow them, normals their
        inverse transpose.  Each of their entries is in one run of memory."""
        df = np.asarray(df, np.float32)
        maps = np.zeros((3, 3, self.count), np.float32)
        for axis in range(3):
            maps[axis, axis] = 1.0
        for index in np.flatnonzero(df):
            gradient = self.gradients[int(index)]
            for cell, values in zip(gradient.cells, gradient.values, strict=True):
                maps[cell] += df[index] * values
        return maps.transpose(2, 0, 1)


def columns_of(jacobian: NDArray[np.floating], parameters: Iterable[int]) -> Columns:
    """The columns of ``jacobian [V, 3, d]`` of some of the parameters."""
    columns = {(axis, index): jacobian[:, axis, index] for index in parameters for axis in range(3)}
    # A column that stayed a part of the Jacobian would keep all of it.
    return {cell: column.copy() for cell, column in columns.items() if column.any()}
