"""How far an edit may go: hard limits and relations hold it back, soft limits are told of.

Hard are that sizes stay positive and that the template's relations of parts (see
`AffineTemplate.limiting`), kept before the edit, are kept after it.  What breaks one is moved to
the nearest values that break none.  Soft is the template's ranges: outside of them shapes are
edited just so, but no model has seen any.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.leastdistance import least_distance
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

LEAST = 1e-3
"""Least size that an edit makes, in the normalised frame, where the shape has radius 0.6."""
SLACK = 0.01
"""A relation kept by less than this share of its terms is one that the fit, not the mesh, keeps
(four thick legs that stand for a pedestal): such a relation does not hold an edit back."""


@dataclass(frozen=True)
class Bounds:
    """The hard limits of one shape's edits: ``rows @ f + constants`` is at least zero.

    Attributes:
        rows, constants: ``[n, d]`` and ``[n]``.
        texts: the same in words.
    """

    rows: Array
    constants: Array
    texts: tuple[str, ...]

    @classmethod
    def of(cls, template: AffineTemplate, before: Array, least: float) -> Bounds:
        """The limits for a shape with parameters ``before [d]``; sizes are at least ``least``.

        The parameters before an edit are within them, whatever they are.
        """
        sizes = np.flatnonzero(~template.signed)
        relations, terms = template.relations, template.relations[:, 1:] * before
        margin = relations[:, 0] + terms.sum(axis=1)
        bound = np.flatnonzero((margin > SLACK * np.abs(terms).sum(axis=1)) & template.limiting)
        return cls(
            rows=np.concatenate([np.eye(len(before))[sizes], relations[bound, 1:]]),
            constants=np.concatenate([-np.minimum(before[sizes], least), relations[bound, 0]]),
            texts=(
                *(f"{template.names[index]} > 0" for index in sizes),
                *(f"{template.relation_texts[index]} >= 0" for index in bound),
            ),
        )

    def broken(self, f: Array) -> list[str]:
        """The limits that parameters ``f [d]`` break, in words."""
        gaps = self._gaps(f)
        return [text for text, gap in zip(self.texts, gaps, strict=True) if gap < 0.0]

    def furthest(self, f: Array, step: Array, relations: bool = False) -> float:
        """The share of a step from ``f [d]``, up to 1, that breaks no size's limit, and with
        `relations` none of those either."""
        among = np.array([relations or text.endswith("> 0") for text in self.texts], bool)
        gaps, speeds = (self.rows @ f + self.constants)[among], (self.rows @ step)[among]
        falling = speeds < 0.0
        return float(np.min(np.maximum(gaps[falling], 0.0) / -speeds[falling], initial=1.0))

    def nearest(self, asked: Array, before: Array) -> Array:
        """The smallest change of ``asked [d]`` that keeps every limit.

        Only parameters that the edit changes give way, each weighed by its size before the edit.

        Args:
            asked: parameters after the edit as the client wants it.
            before: parameters before it, which keep every limit.
        """
        free = np.flatnonzero(asked != before)
        weights = np.maximum(np.abs(before[free]), 1e-3 * np.abs(before).max())
        found = asked.copy()
        # Twice: what is lost to rounding in a step from far away is made good in one from near.
        for _ in range(2):
            found[free] += weights * least_distance(
                self.rows[:, free] * weights, -(self.rows @ found + self.constants)
            )
        return found

    def _gaps(self, f: Array) -> Array:
        """Zero or above where a limit is kept, to within rounding."""
        terms = self.rows * f
        gaps = terms.sum(axis=1) + self.constants
        rounding = 1e-9 * (np.abs(terms).sum(axis=1) + np.abs(self.constants))
        kept: Array = np.where(np.abs(gaps) <= rounding, 0.0, gaps)
        return kept


def unusual(template: AffineTemplate, before: Array, after: Array) -> list[str]:
    """The changed parameters that leave the template's ranges, in proportion to the others.

    Scale is free: a shape is within the ranges when it is at some size.  One that was outside
    before the edit says nothing new.

    Args:
        template: the category.
        before, after: ``[d]`` parameters in any one unit.
    """
    if _window(template, before) is None or (window := _window(template, after)) is not None:
        return []
    sizes = _sizes(template)
    unchanged = sizes[after[sizes] == before[sizes]]
    window = _window(template, before, unchanged)
    low, high = window if window is not None else (0.0, np.inf)
    outside = (template.high < low * after) | (template.low > high * after)
    changed = sizes[after[sizes] != before[sizes]]
    return [template.names[i] for i in changed if outside[i]] or [
        template.names[i] for i in changed
    ]


def in_ranges(template: AffineTemplate, f: Array) -> bool:
    """Whether parameters ``f [d]``, in any one unit, are within the template's ranges at some
    size."""
    return bool((f[_sizes(template)] > 0.0).all()) and _window(template, f) is not None


def _window(
    template: AffineTemplate, f: Array, among: NDArray[np.intp] | None = None
) -> tuple[float, float] | None:
    """Least and largest scale that takes parameters ``f [d]`` into the ranges; None without any.

    Of all sizes, or of those with the indices ``among``.
    """
    sizes = _sizes(template) if among is None else among
    low = float(np.max(template.low[sizes] / f[sizes], initial=0.0))
    high = float(np.min(template.high[sizes] / f[sizes], initial=np.inf))
    return (low, high) if low <= high else None


def _sizes(template: AffineTemplate) -> NDArray[np.intp]:
    """Indices of the sizes that a shape has: all but offsets and what is idle in its variant."""
    return np.flatnonzero(~template.signed & template.active)
