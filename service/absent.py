"""What a rigid shape has nothing of, or next to nothing, or of other parts than another has: the
back of a stool, the legs of a pedestal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Which = NDArray[np.bool_]

MAIN = 0.5
"""Main sizes are typically at least this share of the largest of them: a part without its main size
is not there, one without a thickness is a thin part."""
NEGLIGIBLE = 0.1
"""A size is next to none below this share of the least that is typical, for a shape of that size.
Fitted backs of real stools have up to 0.06 of it, the smallest main sizes of real chairs 0.16."""


def idle(template: AffineTemplate) -> Which:
    """``[d]`` the parameters that users see and that move nothing in a variant of a template."""
    return template.public & ~template.active


def missing(template: AffineTemplate, lengths: Array) -> frozenset[str]:
    """Names of the parts that a shape has next to nothing of: their main size is next to none.

    Args:
        template: the variant that was fitted.
        lengths: ``[d]`` its parameters, in any unit.
    """
    low, high = np.array([parameter.typical for parameter in template.parameters]).T
    sizes = template.public & template.active & (low > 0.0)
    middle = np.sqrt(np.where(sizes, low * high, 1.0))
    # The median is of the shape, whatever one of its sizes is; large ones tell more.
    ratio = _median(lengths[sizes] / middle[sizes], middle[sizes])
    main = sizes & (low >= MAIN * np.max(low[sizes], initial=0.0))
    moves = _moved_parts(template)
    none = main & (lengths < NEGLIGIBLE * ratio * low) & ~moves.all(axis=1)
    return frozenset(np.array(template.parts)[moves[none].any(axis=0)].tolist())


def negligible(template: AffineTemplate, lengths: Array) -> Which:
    """The parameters that say next to nothing of a shape, whatever was fitted: those that move but
    parts that are `missing`.

    Args:
        template, lengths: as `missing`.

    Returns:
        ``[d]``, false for those that move nothing at all and for those that users don't see.
    """
    there = ~np.isin(template.parts, list(missing(template, lengths)))
    moves = _moved_parts(template)
    return np.asarray(template.public & template.active & ~moves[:, there].any(axis=1))


def differing(template: AffineTemplate, other: AffineTemplate) -> Which:
    """``[d]`` the parameters that are sizes of other parts in one variant than in the other.

    A column is thicker than legs are, and says nothing of them.  Sizes of the whole, which derived
    dimensions go by, mean the same whatever parts they are of.
    """
    one, two = _sized_parts(template), _sized_parts(other)
    common = np.array([bool(mine & theirs) for mine, theirs in zip(one, two, strict=True)])
    whole = np.zeros(len(template.parameters), bool)
    for dimension in template.derived.values():
        whole[list(dimension.by)] = True
    return np.asarray(template.active & other.active & template.public & ~common & ~whole)


def _sized_parts(template: AffineTemplate) -> list[set[str]]:
    """Names of the parts that each parameter does more to than move them as a whole."""
    sized: list[set[str]] = [set() for _ in template.parameters]
    for index, name in enumerate(template.parts):
        rows = template.jacobian[template.part == index]
        for parameter in np.flatnonzero(np.ptp(rows, axis=0).any(axis=0)):
            sized[parameter].add(name)
    return sized


def _median(values: Array, weights: Array) -> float:
    """The weighted median; 0 of nothing."""
    if not len(values):
        return 0.0
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, 0.5 * below[-1])])


def _moved_parts(template: AffineTemplate) -> Which:
    """``[d, P]`` whether each parameter moves anything of each part."""
    moves: Which = np.any(template.jacobian != 0.0, axis=1)
    parts = [moves[template.part == part].any(axis=0) for part in range(len(template.parts))]
    return np.stack(parts, axis=1)
