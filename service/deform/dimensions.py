"""From changes of parameters and derived dimensions to the parameters after an edit."""

from __future__ import annotations

from collections.abc import Container, Mapping

import numpy as np
from numpy.typing import NDArray

from service.constraints import NONE, Interval
from service.deform.admissible import LEAST, Bounds
from service.deform.bound import Columns
from service.deform.demands import Limits
from service.deform.measured import Level
from service.deform.outcome import Outcome, accorded
from service.deform.readings import Aim, Reading, read
from service.deform.within import within
from service.edits import Change
from service.errors import InvalidRequest
from service.namedentries import require_known
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

EXACT = 1e-6
"""Share of a value that counts as having reached it."""


class Dimensions:
    """A bound mesh's parameters and derived dimensions, and how changes of them play out.

    All lengths are in one unit, the caller's.
    """

    def __init__(
        self,
        template: AffineTemplate,
        parameters: Array,
        vertices: Array,
        scale: float = 1.0,
        columns: Columns | None = None,
        levels: Mapping[str, Level] | None = None,
    ) -> None:
        """
        Args:
            template: the category.
            parameters: ``[d]`` before the edit.
            vertices: ``[V, 3]`` of the mesh, in canonical orientation and any unit.
            scale: lengths in the vertices' unit per length in the parameters' unit.
            columns: displacement of each vertex per unit of each parameter; without them the
                dimensions can be read, not changed.
            levels: where the mesh itself is measured, by dimension (see `find_levels`).
        """
        self.template = template
        self.parameters = parameters
        self.readings = read(template, parameters, vertices, scale, columns or {}, levels or {})
        self._bounds = Bounds.of(template, parameters, LEAST / scale)
        self._still = np.zeros_like(parameters)

    def derived(self, parameters: Array) -> dict[str, float]:
        """Derived dimensions of the mesh once its parameters are ``parameters [d]``."""
        change = self._change(parameters)
        return {
            name: reading.gauge.value(change)
            if (row := reading.dimension.row) is None
            else float(row[0] + row[1:] @ parameters)
            for name, reading in self.readings.items()
        }

    def measured(self, change: Array) -> dict[str, tuple[float, float]]:
        """What the mesh itself measures before and after a change ``[d]``, by dimension."""
        return {
            name: (reading.mesh.value(self._still), reading.mesh.value(change))
            for name, reading in self.readings.items()
            if reading.mesh is not None
        }

    def outcome(
        self,
        changes: Mapping[str, Change],
        strict: bool = False,
        constraints: Mapping[str, Interval] = NONE,
    ) -> Outcome:
        """Parameters after the changes, or the nearest that keep the hard limits.

        Parameters change first.  A derived dimension then moves those of the parameters behind it
        that were not named themselves, each in proportion to its value.  Constraints come last:
        what the changes name stays, and the rest changes by as little as it must, each in shares of
        its value.

        Args:
            changes: by parameter or derived dimension.
            strict: refuse what can't be had to the letter.
            constraints: likewise.

        Raises:
            InvalidRequest: for an unknown name, a size that is asked to be nothing or negative, or
                a derived dimension that nothing is left to change by; when strict, for a limit that
                the changes break.
            Unsatisfiable: for constraints that can't be kept.
        """
        self._require_known((*changes, *constraints))
        asked, aims, limits = self._asked(changes)
        broken = self._bounds.broken(asked)
        found = self._bounds.nearest(asked, self.parameters) if broken else asked
        if constraints:
            found = self._constrained(found, changes, constraints)
        change = self._change(found)
        told, derived = self._told(found, change, aims, constraints)
        now = dict(zip(self.template.names, told.tolist(), strict=True)) | derived
        adjusted = {
            name: (aim.target, now[name])
            for name, aim in aims.items()
            if name not in constraints
            and abs(now[name] - aim.target) > EXACT * max(abs(aim.target), abs(now[name]))
        }
        sought = {name: Interval(aim.target, aim.target) for name, aim in aims.items()}
        between = tuple(dict.fromkeys([*limits, *broken]))
        outcome = Outcome(told, change, derived, adjusted, between, sought | dict(constraints))
        if strict and adjusted:
            raise outcome.refused()
        return outcome

    def _require_known(self, named: tuple[str, ...]) -> None:
        template = self.template
        offered = [n for n, p in zip(template.names, template.public, strict=True) if p]
        known = [*offered, *template.derived]
        require_known(template.name, named, known)

    def _change(self, values: Array) -> Array:
        return np.where(values == self.parameters, 0.0, values - self.parameters)

    def _asked(self, changes: Mapping[str, Change]) -> tuple[Array, dict[str, Aim], list[str]]:
        """Parameters ``[d]`` as the changes want them, what each aims at, and the limits that some
        could not be followed beyond.
        """
        names, derived = self.template.names, self.template.derived
        values, aims, limits = self.parameters.copy(), dict[str, Aim](), list[str]()
        fixed: set[int] = set()
        for index, name in enumerate(names):
            if name in changes:
                values[index] = target = changes[name].apply(values[index])
                if not self.template.signed[index]:
                    _require_positive(name, target)
                aims[name] = Aim(target, target)
                fixed.add(index)
        # Extents last: the mesh is measured once all else has moved.
        for name in sorted(derived, key=lambda n: derived[n].extent is not None):
            if name in changes:
                aims[name] = aim = self.readings[name].aim(changes[name], self._still)
                _require_positive(name, aim.target)
                values, ends = self._reach(self.readings[name], aim.goal, values, fixed)
                limits += ends
                fixed.update(self.readings[name].by)
        return values, aims, limits

    def _told(
        self, values: Array, change: Array, aims: Mapping[str, Aim], named: Container[str]
    ) -> tuple[Array, dict[str, float]]:
        """Parameters ``[d]`` and derived dimensions to tell of.

        A dimension that is measured on the mesh is told of as it was asked for.  If an edit asked,
        the parameters behind it are in accord with that; if a constraint did, they are what moves
        the mesh so far, as sliders at those values do.
        """
        template = self.template
        free = template.public & np.array([name not in aims for name in template.names])
        told, known = values, dict[str, float]()
        for name, reading in self.readings.items():
            if not reading.corrects:
                continue
            if name in named:
                known[name] = reading.gauge.value(change)
            elif name in aims:
                known[name] = aims[name].told(reading.gauge.value(change))
                told = accorded(told, reading, known[name], free)
        rows = {name: reading.dimension.row for name, reading in self.readings.items()}
        return told, {
            name: self.readings[name].gauge.value(change)
            if row is None
            else known.get(name, float(row[0] + row[1:] @ told))
            for name, row in rows.items()
        }

    def _reach(
        self, reading: Reading, goal: float, values: Array, fixed: set[int]
    ) -> tuple[Array, list[str]]:
        """Scale the parameters behind a dimension until its gauge is at the goal.

        Returns:
            The values, and in words the limits on sizes that ended the way there.
        """
        direction = np.zeros_like(values)
        free = [index for index in reading.by if index not in fixed]
        direction[free] = values[free]
        for _ in range(20):
            change = self._change(values)
            start, row = reading.gauge.tangent(change)
            gap = goal - (start + float(row @ change))
            if abs(gap) <= 1e-9 * abs(goal):
                break
            slope = float(row @ direction)
            if abs(slope) < 1e-6 * abs(goal):
                raise self._stuck(reading)
            step = direction * (gap / slope)
            share = self._bounds.furthest(values, step)
            if share < 1.0:
                return values + share * step, self._bounds.broken(values + step)
            values = values + step
        return values, []

    def _stuck(self, reading: Reading) -> InvalidRequest:
        names = ", ".join(self.template.names[index] for index in reading.by)
        return InvalidRequest(
            "dimension_fixed",
            f"{reading.dimension.name} can't be changed: nothing that moves it is free",
            f"Leave out the edits of {names}, or of this dimension.",
        )

    def _constrained(
        self, values: Array, changes: Mapping[str, Change], constraints: Mapping[str, Interval]
    ) -> Array:
        """The values nearest to ``values [d]`` within the constraints; what changes name stays."""
        before, bounds = self.parameters, self._bounds
        sizes = np.maximum(np.abs(before), 1e-3 * np.abs(before).max())
        return within(
            self.template.names,
            before,
            values,
            {name: reading.gauge for name, reading in self.readings.items()},
            changes,
            constraints,
            np.where(self.template.public, sizes, 0.0),
            Limits(bounds.rows, -(bounds.rows @ before + bounds.constants), bounds.texts),
        )


def _require_positive(name: str, value: float) -> None:
    if value <= 0.0:
        raise InvalidRequest(
            "size_not_positive",
            f"{name} would be {value:.4g}",
            "Sizes must stay positive: choose a larger value.",
        )
