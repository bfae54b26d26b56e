"""What a template's parameters and derived dimensions are called, and where they may lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from service.template.guide import Guide

Axis = Literal["x", "y", "z"]


@dataclass(frozen=True)
class Parameter:
    """A semantic parameter: a length in metres, wherever a template speaks of it.

    Attributes:
        name: its name in the API.
        label: its name for people.
        group: the part of the shape it belongs to, to sort sliders by.
        paper: what the paper calls it.
        low, high: the range that synthetic shapes are drawn from.
        typical: where most real shapes lie; what a slider spans.
        nuisance: inferred like the others so that the template fits, but not offered to users.
        follows: what carries it along when others are edited, for a nuisance one.
    """

    name: str
    label: str
    group: str
    paper: str
    low: float
    high: float
    typical: tuple[float, float]
    nuisance: bool = False
    follows: Guide | None = None

    @property
    def signed(self) -> bool:
        """An offset rather than a size: its range reaches down to zero or below."""
        return self.low <= 0.0


@dataclass(frozen=True)
class Derived:
    """A dimension that follows from the parameters, readable and settable.

    Attributes:
        row: ``[1 + d]`` affine row that gives it, or None when it is an extent.
        extent: the axis along which it is measured on the mesh itself, or None.
        by: indices of the parameters that setting it changes, in proportion to their values.
        on: the part on whose upper face the mesh itself is measured, from the mesh's lowest point
            up, to verify what the row says; None where the row alone tells.
    """

    name: str
    label: str
    group: str
    typical: tuple[float, float]
    row: NDArray[np.float64] | None
    extent: Axis | None
    by: tuple[int, ...]
    on: str | None = None
