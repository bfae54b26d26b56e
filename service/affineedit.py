"""Edits of rigid shapes: a mesh bound to an affine template moves linearly in the parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.affineinference import AffineInference
from service.deform import blend, paper
from service.deform.admissible import unusual
from service.deform.binding import Binding
from service.deform.dimensions import Outcome
from service.deform.followers import following
from service.deform.unfold import unfold
from service.edited import Moved, Shift
from service.edits import Change
from service.requests import EditOptions

Array = NDArray[np.float64]


def move(
    found: AffineInference, edits: Mapping[str, Change], options: EditOptions, keep: str
) -> Moved:
    """Carry out an edit.

    Args:
        found: the upload.
        edits: by parameter or derived dimension.
        options: how.
        keep: the point that stays in place.

    Raises:
        InvalidRequest: for an edit that can't be made.
    """
    binding = _bind(found, options.mode)
    deadline.check()
    after = found.dimensions(binding.jacobian).after(edits)
    if options.mode == "blend":
        changed = np.flatnonzero(after != found.parameters).tolist()
        binding = unfold(binding, found.vertices, found.mesh.faces, found.fit.parameters, changed)
    dimensions = found.dimensions(binding.jacobian)
    outcome = dimensions.outcome(edits, options.strict)
    after = outcome.parameters
    change = np.where(after == found.parameters, 0.0, (after - found.parameters) * found.scale)
    _, anchor = found.fit.template.anchor(keep)
    turn, scale = found.best.orientation, found.fit.normalization.scale
    shift = turn.to_own((binding.displace(change) - anchor @ change) / scale)
    linear = turn.maps_to_own(binding.linear(change))
    deadline.check()
    before, now = found.dimensions().derived(found.parameters), dimensions.derived(after)
    return Moved(
        found,
        _parameters(found, after),
        [Shift(name, old, now[name], found.unit) for name, old in before.items()],
        found.mesh.vertices + shift,
        linear,
        _warnings(found, outcome),
    )


def _bind(found: AffineInference, mode: str) -> Binding:
    rule = blend.bind if mode == "blend" else paper.bind
    fit = found.fit
    template = following(fit.template, fit.parameters)
    return rule(found.vertices, found.mesh.faces, template, fit.parameters, fit.translation)


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
        for text in template.broken_relations(after)
        if text not in held
    ]
    warnings += [
        f"{name} is outside of what the model was trained on, for the rest of the shape"
        for name in unusual(template, before, after)
    ]
    return warnings
