"""What becomes of an edit, as it is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.constraints import Interval
from service.deform.readings import Reading
from service.errors import InvalidRequest

Array = NDArray[np.float64]

EXACT = 1e-12
"""Share of a value that is rounding."""


@dataclass(frozen=True)
class Outcome:
    """What becomes of an edit.

    Attributes:
        parameters: ``[d]`` after it.
        change: ``[d]`` what the mesh moves by.  Where a dimension that was asked for is measured on
            the mesh, the parameters before it were off by the rest.
        derived: dimensions after it, by name.
        adjusted: what was asked for and what came of it, by name, where they differ.
        limits: the hard limits that came between, in words; none where edits contradict each other.
        asked: where parameters and dimensions were to lie, by name.
    """

    parameters: Array
    change: Array
    derived: dict[str, float]
    adjusted: dict[str, tuple[float, float]]
    limits: tuple[str, ...]
    asked: dict[str, Interval]

    def refused(self) -> InvalidRequest:
        """The error for what is adjusted, where nothing may be."""
        (name, (asked, found)), *_ = self.adjusted.items()
        if not self.limits:
            fault = "the edits contradict each other"
        else:
            fault = f"{', '.join(self.limits)} would not be kept"
        return InvalidRequest(
            "edit_out_of_bounds",
            f"{name} can't be {asked:.4g}: {fault}",
            f"The nearest that can be had is {found:.4g}; strict=false takes it.",
        )


def accorded(values: Array, reading: Reading, target: float, free: NDArray[np.bool_]) -> Array:
    """Parameters by which a dimension is at a target.

    Args:
        values: ``[d]`` others.
        reading: of a dimension with a row.
        target: its value.
        free: ``[d]`` those that may differ: first of those that setting the dimension changes,
            in proportion, else of all that it depends on.

    Returns:
        ``[d]``, or ``values`` as they are where nothing is free or a size would be none.
    """
    row = reading.dimension.row
    assert row is not None
    behind = [index for index in reading.by if free[index]]
    behind = behind or np.flatnonzero((row[1:] != 0.0) & free).tolist()
    gap = target - float(row[0] + row[1:] @ values)
    slope = float(row[1:][behind] @ values[behind])
    if abs(gap) <= EXACT * abs(target) or abs(slope) < 1e-6 * abs(target) or gap <= -slope:
        return values
    found = values.copy()
    found[behind] *= 1.0 + gap / slope
    return found
