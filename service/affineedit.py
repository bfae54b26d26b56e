"""Edits of rigid shapes: a mesh bound to an affine template moves linearly in the parameters."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from service.affineinference import AffineInference
from service.conflict import conflict_error
from service.constraints import NONE, Interval
from service.deform.admissible import unusual
from service.deform.bound import Bound
from service.deform.demands import Unsatisfiable
from service.deform.dimensions import Dimensions
from service.deform.outcome import Outcome
from service.deform.readings import APART
from service.edited import Measured, Moved, Shift
from service.edits import Change
from service.requests import EditOptions
from service.stages import stage

Array = NDArray[np.float64]

NOTED = 0.02
"""Share of a dimension by which the fit may be off the mesh without remark."""


def move(
    found: AffineInference,
    edits: Mapping[str, Change],
    options: EditOptions,
    keep: str,
    constraints: Mapping[str, Interval] = NONE,
) -> Moved:
    """Carry out an edit.

    Args:
        found: the upload.
        edits: by parameter or derived dimension.
        options: how.
        keep: the point that stays in place.
        constraints: likewise by name; what edits name stays as they have it.

    Raises:
        InvalidRequest: for an edit that can't be made, or constraints that conflict.
    """
    bound = found.bound(options.mode)
    with stage("transfer"):
        try:
            bound, dimensions, outcome = _settled(found, bound, edits, options, constraints)
        except Unsatisfiable as conflict:
            raise conflict_error(conflict, lambda _: found.unit) from conflict
        return _moved(found, bound, dimensions, outcome, keep)


def _settled(
    found: AffineInference,
    bound: Bound,
    edits: Mapping[str, Change],
    options: EditOptions,
    constraints: Mapping[str, Interval],
) -> tuple[Bound, Dimensions, Outcome]:
    """What an edit comes to, and the mesh with fewer folds for what that changes."""
    dimensions = found.dimensions(bound)
    outcome = dimensions.outcome(edits, constraints=constraints)
    better = bound
    if options.mode == "blend":
        better = found.unfolded(np.flatnonzero(outcome.change).tolist())
    if better is bound and not options.strict:
        return bound, dimensions, outcome
    dimensions = found.dimensions(better)
    return better, dimensions, dimensions.outcome(edits, options.strict, constraints)


def _moved(
    found: AffineInference, bound: Bound, dimensions: Dimensions, outcome: Outcome, keep: str
) -> Moved:
    """The mesh after an edit that has come to an outcome."""
    fit, turn = found.fit, found.best.orientation
    change = outcome.change * found.scale
    _, anchor = fit.template.anchor(keep)
    moved, linear = bound.displace(change), bound.linear(change)
    shift = turn.to_own((moved - anchor @ change) / fit.normalization.scale)
    before = found.dimensions().derived(found.parameters)
    return Moved(
        found,
        _parameters(found, outcome.parameters),
        [Shift(name, old, outcome.derived[name], found.unit) for name, old in before.items()],
        [
            Measured(name, *values, found.unit, outcome.asked.get(name))
            for name, values in dimensions.measured(outcome.change).items()
        ],
        found.mesh.vertices + shift,
        turn.maps_to_own(linear),
        found.flips(bound, moved, linear),
        [*_warnings(found, outcome), *_measures(found, dimensions, outcome)],
    )


def _parameters(found: AffineInference, after: Array) -> list[Shift]:
    """Those that users see."""
    template = found.model.template
    columns = (found.parameters.tolist(), after.tolist(), template.public)
    rows = zip(template.names, *columns, strict=True)
    return [Shift(name, old, new, found.unit) for name, old, new, seen in rows if seen]


def _warnings(found: AffineInference, outcome: Outcome) -> list[str]:
    template, before, after = found.fit.template, found.parameters, outcome.parameters
    reason = ", ".join(outcome.limits)
    warnings = [
        f"{name} is {got:.4g} {found.unit}, not {asked:.4g}: "
        + (f"the nearest that keeps {reason}" if reason else "the edits contradict each other")
        for name, (asked, got) in outcome.adjusted.items()
    ]
    # What the bounds keep may miss zero by rounding.
    held = template.broken_relations(before) + [
        text.removesuffix(" >= 0") for text in outcome.limits
    ]
    warnings += [
        f"{text} is now negative: parts may run into each other"
        for text in compress(template.relation_texts, template.limiting.tolist())
        if text in template.broken_relations(after) and text not in held
    ]
    warnings += [
        f"{name} is outside of what the model was trained on, for the rest of the shape"
        for name in unusual(template, before, after)
    ]
    return warnings


def _measures(found: AffineInference, dimensions: Dimensions, outcome: Outcome) -> list[str]:
    """What to say where a dimension that was asked for is another on the mesh than in the fit."""
    warnings = []
    for name, reading in dimensions.readings.items():
        if name not in outcome.asked or reading.dimension.on is None:
            continue
        if reading.mesh is None:
            warnings.append(f"{name} can't be measured on this mesh: the edit goes by the fit")
            continue
        measured = reading.mesh.value(np.zeros_like(found.parameters))
        values = (
            f"{measured:.4g} {found.unit} on the mesh before the edit, and {reading.fitted:.4g} "
            "in the fit"
        )
        if not reading.corrects:
            far = abs(measured - reading.fitted) > APART * reading.fitted
            why = "too far apart" if far else "this mesh does not follow the parameters behind it"
            warnings.append(f"{name} is {values}; {why}: the edit goes by the fit")
        elif abs(measured - reading.fitted) > NOTED * reading.fitted:
            warnings.append(f"{name} is {values}: the edit goes by the mesh")
    return warnings
