"""Draws for rigid shapes: lengths on the way from the source's to those of a real shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.affineinference import AffineInference
from service.augment.distribution import OVERALL_SIZE, Distribution
from service.augment.draw import FARTHEST, Draw, some
from service.deform.admissible import LEAST, Bounds, unusual
from service.edits import Change
from service.requests import UNITS
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

TRIES = 50
"""Draws of which the first is taken that the template's ranges and relations allow."""
DIGITS = 6
"""Significant ones of the values that are set."""


class AffineSampler:
    """Draws edits of one shape.

    Lengths are told apart as proportions of the overall size, the diagonal of the fitted template's
    bounding box, and that size.  The size changes only where the source's own is one that real
    shapes have: a chair 80 m tall is no measure of how tall chairs are.
    """

    def __init__(self, found: AffineInference):
        self._template = found.fit.template
        self._before = found.parameters
        self._open = np.flatnonzero(self._template.public & self._template.active)
        self._size = overall_size(self._template, self._before)
        self._metre = 1.0 / UNITS[found.unit]
        self._bounds = Bounds.of(self._template, self._before, LEAST / found.scale)
        self._distribution = Distribution.of(found.model)

    @property
    def real(self) -> bool:
        """Whether draws are like real shapes; they are within typical ranges otherwise."""
        return self._distribution is not None

    def draw(self, rng: np.random.Generator, strength: float) -> Draw:
        """Edits that go some of the way to a real-looking shape.

        Args:
            rng: where chance comes from.
            strength: the largest share of the way.
        """
        goal = self._goal(rng)
        share = strength * some(rng)
        chosen = self._open[_subset(rng, len(self._open))]
        after = _between(self._before, goal, share, self._template.signed)
        return Draw(
            {
                self._template.names[index]: Change("set", float(f"{after[index]:.{DIGITS}g}"))
                for index in chosen.tolist()
            },
            share,
        )

    def _goal(self, rng: np.random.Generator) -> Array:
        """``[d]`` parameters of a real-looking shape of the source's kind."""
        for _ in range(TRIES):
            goal = self._before.copy()
            if self._distribution is None:
                self._typical(rng, goal)
            else:
                self._like_real(rng, self._distribution, goal)
            if not self._bounds.broken(goal) and not unusual(self._template, self._before, goal):
                break
        # The edit itself makes the nearest that can be had of one that is beyond the limits.
        return goal

    def _like_real(self, rng: np.random.Generator, distribution: Distribution, goal: Array) -> None:
        values = distribution.draw(rng, self._template.variant)
        low, high = distribution.ends(OVERALL_SIZE, self._template.variant)
        size, drawn = self._size, values.pop(OVERALL_SIZE, None)
        if drawn is not None and low <= np.log(size / self._metre) <= high:
            size = float(np.exp(drawn)) * self._metre
        goal *= size / self._size
        for name, value in values.items():
            index = self._template.names.index(name)
            goal[index] = size * (value if self._template.signed[index] else np.exp(value))

    def _typical(self, rng: np.random.Generator, goal: Array) -> None:
        """Independent draws within what is typical, in proportion to the size that there is."""
        for index in self._open.tolist():
            low, high = self._template.parameters[index].typical
            if self._template.signed[index]:
                goal[index] = rng.uniform(low, high) * self._metre
            else:
                goal[index] = np.exp(rng.uniform(np.log(low), np.log(high))) * self._metre
        goal[self._open] *= self._size / overall_size(self._template, goal)


def overall_size(template: AffineTemplate, parameters: Array) -> float:
    """The diagonal of the bounding box of a template with ``parameters [d]``, in their unit."""
    return float(np.linalg.norm(np.ptp(template.decode(parameters), axis=0)))


def _subset(rng: np.random.Generator, count: int) -> NDArray[np.bool_]:
    """``[count]`` which parameters change: half of the time all, else each with even odds."""
    chosen = np.ones(count, bool)
    if rng.random() < 0.5:
        chosen = rng.random(count) < 0.5
        chosen[rng.integers(count)] = True
    return chosen


def _between(before: Array, goal: Array, share: float, signed: NDArray[np.bool_]) -> Array:
    """``[d]`` a share of the way: in ratio for sizes, which change `FARTHEST` times at most; in
    difference for offsets."""
    tiny = np.finfo(float).tiny
    ratio = np.maximum(goal, tiny) / np.maximum(before, tiny)
    factor = np.clip(ratio**share, 1.0 / FARTHEST, FARTHEST)
    return np.where(signed, before + share * (goal - before), before * factor)
