"""Transfers between rigid shapes: lengths, in real units or in proportion."""

from __future__ import annotations

from collections.abc import Sequence, Set
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from service.absent import differing, idle, missing, negligible
from service.affineinference import AffineInference
from service.edited import Moved
from service.requests import TransferOptions
from service.sliders import chosen
from service.template.affine import AffineTemplate
from service.transfer import (
    Taken,
    canonical,
    of_target,
    set_to,
    shifted,
    unit_ratio,
)

Array = NDArray[np.float64]


def take(
    found: AffineInference, other: AffineInference, options: TransferOptions, keep: str
) -> Taken:
    """What an edit of a shape takes from another.

    Lengths are the target's own; with ``size=source`` times the ratio of the two sizes, so that the
    target's proportions come at the source's size.  That is the diagonal of the fitted template's
    bounding box along the canonical axes, less what one of the two has next to nothing of: beside a
    stool, a chair counts without its back.

    Args:
        found: the source.
        other: the target.
        options: what to take; parameters and derived dimensions may be named.
        keep: the point that is put where the target's is, if so.

    Raises:
        InvalidRequest: for an unknown name.
    """
    names, warnings = _moving(_wanted(found, other, options), found, other)
    ratio = unit_ratio(found, other)
    scale = 1.0 if options.size == "target" else _size_ratio(found, other) / ratio
    theirs, own = _values(other), _values(found)
    values = {name: theirs[name] * ratio for name in names}
    edits = set_to({name: value * scale for name, value in values.items()}, own)
    units = dict.fromkeys(names, found.unit)
    goal = None
    if options.position == "target":
        goal = _foothold(other, other.mesh.vertices, keep) * ratio
    return Taken(edits, values, units, scale, goal, [*of_target(other.warnings), *warnings])


def _wanted(
    found: AffineInference, other: AffineInference, options: TransferOptions
) -> Sequence[str]:
    """Names of what to take: of what both have, which may be of two versions of a model."""
    template, theirs = found.model.template, other.model.template
    both = [name for name in _public(template) if name in _public(theirs)]
    if options.parameters is None:
        return both
    derived = [name for name in template.derived if name in theirs.derived]
    return chosen([*both, *derived], options.parameters, template.name)


def _public(template: AffineTemplate) -> list[str]:
    return [name for name, seen in zip(template.names, template.public, strict=True) if seen]


def _moving(
    names: Sequence[str], found: AffineInference, other: AffineInference
) -> tuple[list[str], list[str]]:
    """Those of the names that mean something in both shapes, and a warning of the others."""
    one, two = found.fit.template, other.fit.template
    variants = [template.variant.replace("_", " ") for template in (one, two)]
    reasons = [
        (one, idle(one), f"the source is a {variants[0]}, in which nothing moves by that"),
        (two, idle(two), f"the target is a {variants[1]}, in which nothing moves by that"),
        (one, negligible(one, found.parameters), "the source has next to nothing of the kind"),
        (two, negligible(two, other.parameters), "the target has next to nothing of the kind"),
    ]
    # Two versions of a model may have other parameters.
    if one.names == two.names:
        why = f"in a {variants[0]} and a {variants[1]} they are of other parts"
        reasons.append((one, differing(one, two), why))
    left, warnings = list(names), []
    for template, among, why in reasons:
        if still := [name for name in compress(template.names, among) if name in left]:
            left = [name for name in left if name not in still]
            verb = "is" if len(still) == 1 else "are"
            warnings.append(f"{', '.join(still)} {verb} left out: {why}")
    return left, warnings


def _values(found: AffineInference) -> dict[str, float]:
    """Parameters and derived dimensions by name, as `POST /infer` tells them."""
    own = dict(zip(found.model.template.names, found.parameters.tolist(), strict=True))
    return own | found.dimensions().derived(found.parameters)


def _size_ratio(found: AffineInference, other: AffineInference) -> float:
    """How many times as large the first is as the other, each in its reported unit."""
    without: set[str] = set()
    for shape in (found, other):
        without |= missing(shape.fit.template, shape.parameters)
    return _size(found, without) / _size(other, without)


def _size(found: AffineInference, without: Set[str]) -> float:
    """Diagonal of the fitted template's bounding box, in the reported unit, less some parts."""
    template = found.fit.template
    counted = ~np.isin(template.parts, list(without))
    vertices = template.decode(found.parameters)[counted[template.part]]
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))


def place(moved: Moved, goal: Array | None, keep: str) -> Moved:
    """The edited mesh with its kept point at a goal; without one where the edit has left it."""
    found = moved.found
    assert isinstance(found, AffineInference)
    return moved if goal is None else shifted(moved, goal - _foothold(found, moved.vertices, keep))


def _foothold(found: AffineInference, vertices: Array, keep: str) -> Array:
    """``[3]`` the kept point, canonical and in the reported unit; an edit leaves it there.

    The floor is where the vertices themselves stand on it.
    """
    fit = found.fit
    constant, rows = fit.template.anchor(keep)
    point = fit.normalization.invert(constant + rows @ fit.parameters + fit.translation)
    point = point * found.unit_scale
    if keep == "floor" and fit.template.stands:
        point[1] = canonical(found, vertices)[:, 1].min()
    return np.asarray(point)
