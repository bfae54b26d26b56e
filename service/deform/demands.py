"""What is demanded of a mesh, and what of it can't be had."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.constraints import Interval
from service.deform.gauges import Gauge

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Demand:
    """What is demanded of a gauge.

    Attributes:
        name: of the parameter or dimension.
        gauge: of the change.
        interval: where its value is to lie.
        firm: it holds already, and is to go on to; only others give way.
    """

    name: str
    gauge: Gauge
    interval: Interval
    firm: bool = False


@dataclass(frozen=True)
class Limits:
    """Inequalities ``rows [n, d] @ change >= least [n]``, with their texts, that always hold."""

    rows: Array
    least: Array
    texts: tuple[str, ...]


@dataclass(frozen=True)
class Conflict:
    """A demand that can't be met with the others: the value that can, and by how much it is off."""

    name: str
    interval: Interval
    nearest: float
    by: float


class Unsatisfiable(Exception):
    """Demands that contradict each other, or the limits.

    Attributes:
        conflicts: demands that would have to give way, and how far, for all to be met.
        held: firm demands that stand against them.
        limits: and limits, in words.
    """

    def __init__(
        self, conflicts: Sequence[Conflict], held: Sequence[str], limits: Sequence[str]
    ) -> None:
        super().__init__(", ".join(conflict.name for conflict in conflicts))
        self.conflicts, self.held, self.limits = conflicts, held, limits
