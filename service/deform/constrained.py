"""The smallest change of the parameters that keeps what is demanded of a mesh.

Least distance programming, again and again: a gauge's upper bound is cut off plane by plane (it is
convex), its lower bound is that of the plane that it is at the last answer.  Each answer to lower
bounds is one that keeps them, and the next is no longer; planes that were cut stay cut; so this
ends.  Demands that contradict each other give way until they do not: as little as can be, in shares
of their values, least squares.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.deform.demands import Conflict, Demand, Limits, Unsatisfiable
from service.deform.leastdistance import Contradiction, least_distance

Array = NDArray[np.float64]
Plane = tuple[float, Array]
"""An affine function of a change: its value without any, and its row ``[d]``."""

EXACT = 1e-10
"""Share of a value within which a bound is kept."""
ROUNDS, ATTEMPTS = 30, 60
MARGIN = 1e-6
"""Demands give way by so much more than they must, lest what remains hang on rounding."""
FIRM = 1e-6
"""How readily a firm demand gives way beside one that is not."""
IDLE = 1e-5
"""A parameter that would change by less than this share of the largest change stays."""


def constrained(start: Array, weights: Array, demands: Sequence[Demand], limits: Limits) -> Array:
    """The change ``[d]`` nearest to ``start [d]`` that meets all demands.

    Args:
        start: a change that keeps the limits and meets the firm demands.
        weights: ``[d]`` sizes of the parameters, which distances are shares of; zero for those that
            stay.
        demands: of gauges.
        limits: beside them.

    Raises:
        Unsatisfiable: when there is none.
    """
    search = _Search(start, weights, demands, limits)
    change = start
    tangents = search.tangents(start)
    for _ in range(ROUNDS):
        deadline.check()
        search.cut(tangents)
        change = search.shortest()
        tangents = search.tangents(change)
        if search.settled(change, tangents):
            break
    search.refuse()
    return change


class _Search:
    """The planes found so far.  A side is one end of one demand's interval."""

    def __init__(
        self, start: Array, weights: Array, demands: Sequence[Demand], limits: Limits
    ) -> None:
        self.start, self.demands, self.limits = start, demands, limits
        self.free = np.flatnonzero(weights > 0.0)
        self.weights = weights[self.free]
        self.sides = [
            (demand, sign, end)
            for demand in demands
            for sign, end in ((1.0, demand.interval.low), (-1.0, demand.interval.high))
            if np.isfinite(end)
        ]
        self.planes: list[list[Plane]] = [[] for _ in self.sides]
        now = [_at(plane, start) for plane in self.tangents(start)]
        ends = zip(self.sides, now, strict=True)
        sizes = [max(abs(end), abs(value)) or 1.0 for (_, _, end), value in ends]
        self.sizes = np.array(sizes)
        self.ease = self.sizes * [FIRM if demand.firm else 1.0 for demand, _, _ in self.sides]
        self.slack = np.zeros(len(self.sides))
        self.against: set[int] = set()

    def tangents(self, change: Array) -> list[Plane]:
        """The plane that each side's gauge is at a change."""
        planes = {id(d.gauge): d.gauge.tangent(change) for d in self.demands}
        return [planes[id(demand.gauge)] for demand, _, _ in self.sides]

    def cut(self, tangents: Sequence[Plane]) -> None:
        """Add planes; of lower bounds the last one counts."""
        for planes, plane, (_, sign, _) in zip(self.planes, tangents, self.sides, strict=True):
            if sign > 0.0:
                planes.clear()
            planes.append(plane)

    def shortest(self) -> Array:
        """The nearest change ``[d]`` by the planes; demands give way where they must."""
        rows, least, owner = self._inequalities()
        self.slack[:], self.against = 0.0, set()
        sides = np.flatnonzero(owner >= 0)
        give = np.zeros(len(least))
        for attempt in range(ATTEMPTS):
            give[sides] = self.slack[owner[sides]]
            try:
                return self._changed(rows, least - give)
            except Contradiction as proof:
                gap = float(proof.weights @ (least - give))
                # What is but rounding doubles, so that this ends.
                self._give_way(proof.weights, gap, owner, EXACT * 2.0**attempt)
        raise RuntimeError("demands that have given way still contradict each other")

    def _inequalities(self) -> tuple[Array, Array, NDArray[np.intp]]:
        """``[n, d]`` and ``[n]`` inequalities of the steps from the start, in shares of the
        weights, and ``[n]`` which side each belongs to; -1 for limits."""
        limits = self.limits
        kept = limits.rows @ self.start
        rows, least = [*limits.rows], [*np.minimum(limits.least - kept, 0.0)]
        owner = [-1] * len(rows)
        for index, (planes, (_, sign, end)) in enumerate(zip(self.planes, self.sides, strict=True)):
            for value, row in planes:
                short = sign * (end - value - row @ self.start)
                rows.append(sign * row)
                least.append(short if short > EXACT * self.sizes[index] else min(short, 0.0))
                owner.append(index)
        scaled = np.array(rows).reshape(-1, len(self.start))[:, self.free] * self.weights
        return scaled, np.array(least), np.array(owner, np.intp)

    def _changed(self, rows: Array, least: Array) -> Array:
        step = least_distance(rows, least)
        if step.any():
            moving = np.flatnonzero(np.abs(step) > IDLE * np.abs(step).max())
            step = _exactly(rows, least, step, moving)
        change = self.start.copy()
        change[self.free] += self.weights * step
        return change

    def _give_way(
        self, weights: Array, gap: float, owner: NDArray[np.intp], rounding: float
    ) -> None:
        """Let the sides that take part in a proof give way until it proves nothing.

        That is where ``weights @ give = gap``; of all such the one with the least squares.
        """
        part = np.flatnonzero(weights > 0.0)
        sides = part[owner[part] >= 0]
        pull = np.bincount(owner[sides], weights[sides], len(self.sides))
        give = np.square(self.ease) * pull
        give *= (1.0 + MARGIN) * gap / (pull @ give)
        self.slack += np.where(pull > 0.0, np.maximum(give, rounding * self.ease), 0.0)
        self.against |= {int(index) for index in part if owner[index] < 0}
        self.against |= {len(self.limits.texts) + int(side) for side in np.unique(owner[sides])}

    def settled(self, change: Array, tangents: Sequence[Plane]) -> bool:
        """Whether the gauges, whose tangents at a change are given, keep there what planes do."""
        for index, (_, sign, end) in enumerate(self.sides):
            value = _at(tangents[index], change)
            bound, near = end - sign * self.slack[index], EXACT * self.sizes[index]
            if sign < 0.0 and value > bound + near:
                return False
            planed = _at(self.planes[index][-1], change)
            if sign > 0.0 and planed <= bound + near and value > planed + near:
                return False
        return True

    def refuse(self) -> None:
        """Raise `Unsatisfiable` where demands had to give way."""
        given: dict[str, Conflict] = {}
        for slack, size, (demand, sign, end) in zip(
            self.slack, self.sizes, self.sides, strict=True
        ):
            known = given.get(demand.name)
            if demand.firm or slack <= 10 * EXACT * size or (known and known.by >= slack):
                continue
            nearest = end - sign * float(slack)
            given[demand.name] = Conflict(demand.name, demand.interval, nearest, float(slack))
        if not given:
            return
        count = len(self.limits.texts)
        held = [self.sides[index - count][0] for index in sorted(self.against) if index >= count]
        texts = [self.limits.texts[index] for index in sorted(self.against) if index < count]
        names = [demand.name for demand in held if demand.firm]
        raise Unsatisfiable([*given.values()], [*dict.fromkeys(names)], texts)


def _at(plane: Plane, change: Array) -> float:
    return plane[0] + float(plane[1] @ change)


def _exactly(rows: Array, least: Array, step: Array, moving: NDArray[np.intp]) -> Array:
    """The step by the parameters ``moving`` alone, and again from near, where rounding is small."""
    try:
        found = np.zeros_like(step)
        for _ in range(2):
            found[moving] += least_distance(rows[:, moving], least - rows @ found)
    except Contradiction:
        return step
    return found
