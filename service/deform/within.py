"""Parameters within constraints, from those after the edits on."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from service.constraints import Interval
from service.deform.constrained import constrained
from service.deform.demands import Demand, Limits
from service.deform.gauges import Gauge

Array = NDArray[np.float64]


def within(
    names: Sequence[str],
    before: Array,
    values: Array,
    gauges: Mapping[str, Gauge],
    edited: Collection[str],
    constraints: Mapping[str, Interval],
    weights: Array,
    limits: Limits,
) -> Array:
    """The parameters nearest to ``values`` that keep to the constraints.

    Args:
        names: of the ``d`` parameters.
        before: ``[d]`` before the edits, which the gauges' changes start from.
        values: ``[d]`` after them; they keep the limits.
        gauges: further dimensions than the parameters, by name.
        edited: parameters and dimensions that stay as they have become.
        constraints: where others are to lie.
        weights: ``[d]`` sizes that distances are shares of; zero for parameters that stay.
        limits: of the change, beside them.

    Raises:
        Unsatisfiable: when there are none.
    """

    def gauge(name: str) -> Gauge:
        if name in gauges:
            return gauges[name]
        index = names.index(name)
        return Gauge.affine(float(before[index]), np.eye(len(names))[index])

    start = np.where(values == before, 0.0, values - before)
    held = [(name, gauge(name)) for name in edited]
    now = [(name, known, known.value(start)) for name, known in held]
    firm = [Demand(name, known, Interval(at, at), firm=True) for name, known, at in now]
    wanted = [Demand(name, gauge(name), interval) for name, interval in constraints.items()]
    change = constrained(start, weights, [*firm, *wanted], limits)
    nearest = np.where(change == start, values, before + change)
    for index, name in enumerate(names):
        if name in edited:
            nearest[index] = values[index]
        elif name in constraints:
            # To the bit, where it is there but for rounding.
            ends = constraints[name]
            nearest[index] = np.clip(nearest[index], ends.low, ends.high)
    return nearest
