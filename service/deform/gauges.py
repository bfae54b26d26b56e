"""What is measured on a mesh that moves linearly in the parameters: a piecewise linear function.

A gauge is the distance along an axis from the lowest of some points to the highest of others, each
point affine in a change of the parameters.  It is convex: nowhere below the affine function that it
is here, which makes an upper bound on it a set of linear inequalities.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Heights:
    """Affine functions of a change ``[d]`` of the parameters: ``values + rows @ change``.

    Attributes:
        values: ``[n]`` without a change.
        columns: ``[n]`` of ``rows [n, d]``, by parameter; those that are left out are zero.
    """

    values: Array
    columns: Mapping[int, NDArray[np.floating]]

    @classmethod
    def of(cls, values: Array, rows: NDArray[np.floating]) -> Heights:
        """From all ``rows [n, d]``."""
        moving = np.flatnonzero(rows.any(axis=0)).tolist()
        return cls(values, {index: rows[:, index] for index in moving})

    def at(self, change: Array) -> Array:
        """``[n]`` after a change."""
        moved = self.values
        for index, column in self.columns.items():
            if change[index]:
                moved = moved + change[index] * column
        return moved

    def row(self, index: int, size: int) -> Array:
        """``[d]`` how one of them depends on the change."""
        row = np.zeros(size)
        for parameter, column in self.columns.items():
            row[parameter] = column[index]
        return row


@dataclass(frozen=True)
class Gauge:
    """A length: the highest of ``tops`` less the lowest of ``bottoms``, or less nothing."""

    tops: Heights
    bottoms: Heights | None = None

    @classmethod
    def affine(cls, value: float, row: Array) -> Gauge:
        """One that is linear: ``value + row [d] @ change``."""
        return cls(Heights.of(np.array([value]), row[None]))

    def value(self, change: Array) -> float:
        """What it measures after a change ``[d]``."""
        top = float(self.tops.at(change).max())
        return top if self.bottoms is None else top - float(self.bottoms.at(change).min())

    def tangent(self, change: Array) -> tuple[float, Array]:
        """The affine function that it is at a change ``[d]``: its value without a change, and its
        row ``[d]``.  It is nowhere above the gauge.
        """
        top = int(self.tops.at(change).argmax())
        value, row = float(self.tops.values[top]), self.tops.row(top, len(change))
        if self.bottoms is None:
            return value, row
        bottom = int(self.bottoms.at(change).argmin())
        return (
            value - float(self.bottoms.values[bottom]),
            row - self.bottoms.row(bottom, len(change)),
        )
