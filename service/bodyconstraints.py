"""Constraints on bodies: angles and coefficients in their intervals, the stature by one of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from service.bodyinference import PARAMETER_UNITS, BodyInference
from service.conflict import conflict_error
from service.constraints import Interval
from service.deform.demands import Limits, Unsatisfiable
from service.deform.gauges import Gauge, Heights
from service.deform.within import within
from service.edits import Change
from service.template.skinned import NAMES, SHAPES

Array = NDArray[np.float64]

STATURE = "stature"
TALLER = NAMES[len(NAMES) - SHAPES]
"""The coefficient that a change of the stature changes."""


def constrain(
    found: BodyInference,
    values: Array,
    edits: Mapping[str, Change],
    constraints: Mapping[str, Interval],
) -> Array:
    """The parameters ``[75]`` nearest to ``values [75]`` that keep to the constraints.

    Only parameters that constraints name change, and the coefficient behind a stature.

    Args:
        found: the upload.
        values: its parameters after the edits.
        edits: what they name stays.
        constraints: by parameter, or of the stature.

    Raises:
        InvalidRequest: for constraints that conflict.
    """
    free = {*edits, *constraints}
    if STATURE in free:
        free.add(TALLER)
    weights = np.array([1.0 if name in free else 0.0 for name in NAMES])
    gauges = {STATURE: _stature(found)}
    none = Limits(np.zeros((0, len(NAMES))), np.zeros(0), ())
    try:
        return within(NAMES, found.parameters, values, gauges, edits, constraints, weights, none)
    except Unsatisfiable as conflict:
        raise conflict_error(conflict, lambda name: _unit(found, name)) from conflict


def _stature(found: BodyInference) -> Gauge:
    """The extent of the template, standing straight: its vertices are linear in the shape."""
    template, body = found.model.template, found.fit.body
    reported = body.scale / found.scale
    heights = template.shaped(body.shape)[0][:, 1]
    rows = np.zeros((len(heights), len(NAMES)))
    rows[:, -SHAPES:] = template.shapedirs[:, 1]
    ends = Heights.of(heights * reported, rows * reported)
    return Gauge(ends, ends)


def _unit(found: BodyInference, name: str) -> str:
    return found.unit if name == STATURE else PARAMETER_UNITS[NAMES.index(name)]
