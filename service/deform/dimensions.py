"""From changes of parameters and derived dimensions to the parameters after an edit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.admissible import LEAST, Bounds
from service.edits import Change
from service.errors import InvalidRequest
from service.template.affine import AffineTemplate
from service.template.parameters import Derived

Array = NDArray[np.float64]


EXACT = 1e-6
"""Share of a value that counts as having reached it."""


@dataclass(frozen=True)
class Outcome:
    """What becomes of an edit.

    Attributes:
        parameters: ``[d]`` after it.
        adjusted: what was asked for and what came of it, by name, where they differ.
        limits: the hard limits that came between, in words; none where edits contradict each other.
    """

    parameters: Array
    adjusted: dict[str, tuple[float, float]]
    limits: tuple[str, ...]


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
        jacobian: NDArray[np.floating] | None = None,
    ) -> None:
        """
        Args:
            template: the category.
            parameters: ``[d]`` before the edit.
            vertices: ``[V, 3]`` of the mesh, in canonical orientation and any unit.
            scale: lengths in the vertices' unit per length in the parameters' unit.
            jacobian: ``[V, 3, d]`` displacement of each vertex per unit of each parameter; without
                it the dimensions can be read, not changed.
        """
        self.template = template
        self.parameters = parameters
        self.vertices = vertices
        self.scale = scale
        self.jacobian = jacobian
        self._bounds = Bounds.of(template, parameters, LEAST / scale)

    def derived(self, parameters: Array) -> dict[str, float]:
        """Derived dimensions of the mesh once its parameters are ``parameters [d]``."""
        return {n: self._measure(d, parameters) for n, d in self.template.derived.items()}

    def after(self, changes: Mapping[str, Change]) -> Array:
        """Parameters ``[d]`` after the changes; see `outcome`."""
        return self.outcome(changes).parameters

    def outcome(self, changes: Mapping[str, Change], strict: bool = False) -> Outcome:
        """Parameters after the changes, or the nearest that keep the hard limits.

        Parameters change first.  A derived dimension then moves those of the parameters behind it
        that were not named themselves, each in proportion to its value.

        Args:
            changes: by parameter or derived dimension.
            strict: refuse what can't be had to the letter.

        Raises:
            InvalidRequest: for an unknown name, a size that is asked to be nothing or negative, or
                a derived dimension that nothing is left to change by; when strict, for a limit that
                the changes break.
        """
        self._require_known(changes)
        asked, targets, limits = self._asked(changes)
        broken = self._bounds.broken(asked)
        found = self._bounds.nearest(asked, self.parameters) if broken else asked
        now = dict(zip(self.template.names, found.tolist(), strict=True)) | self.derived(found)
        adjusted = {
            name: (target, now[name])
            for name, target in targets.items()
            if abs(now[name] - target) > EXACT * max(abs(target), abs(now[name]))
        }
        outcome = Outcome(found, adjusted, tuple(dict.fromkeys([*limits, *broken])))
        if strict and adjusted:
            raise _refused(outcome)
        return outcome

    def _require_known(self, changes: Mapping[str, Change]) -> None:
        template = self.template
        offered = [n for n, p in zip(template.names, template.public, strict=True) if p]
        known = [*offered, *template.derived]
        unknown = [name for name in changes if name not in known]
        if unknown:
            raise InvalidRequest(
                "unknown_parameter",
                f"{template.name} has no parameter {unknown[0][:80]!r}",
                f"Known are {', '.join(known)}.",
            )

    def _asked(self, changes: Mapping[str, Change]) -> tuple[Array, dict[str, float], list[str]]:
        """Parameters ``[d]`` as the changes want them, the value that each aims at, and the limits
        that some could not be followed beyond.
        """
        names, derived = self.template.names, self.template.derived
        before = self.derived(self.parameters)
        values, targets, limits = self.parameters.copy(), dict[str, float](), list[str]()
        fixed: set[int] = set()
        for index, name in enumerate(names):
            if name in changes:
                values[index] = targets[name] = changes[name].apply(values[index])
                if not self.template.signed[index]:
                    _require_positive(name, targets[name])
                fixed.add(index)
        # Extents last: the mesh is measured once all else has moved.
        for name in sorted(derived, key=lambda n: derived[n].extent is not None):
            if name in changes:
                targets[name] = changes[name].apply(before[name])
                _require_positive(name, targets[name])
                values, ends = self._reach(derived[name], targets[name], values, fixed)
                limits += ends
                fixed.update(derived[name].by)
        return values, targets, limits

    def _measure(self, dimension: Derived, parameters: Array) -> float:
        if dimension.row is not None:
            return float(dimension.row[0] + dimension.row[1:] @ parameters)
        return float(np.ptp(self._coordinates(dimension, parameters)))

    def _coordinates(self, dimension: Derived, parameters: Array) -> Array:
        axis = "xyz".index(dimension.extent or "x")
        coordinates: Array = self.vertices[:, axis] / self.scale
        change = parameters - self.parameters
        if self.jacobian is None or not change.any():
            return coordinates
        return coordinates + self.jacobian[:, axis] @ change

    def _reach(
        self, dimension: Derived, target: float, values: Array, fixed: set[int]
    ) -> tuple[Array, list[str]]:
        """Scale the parameters behind a dimension until it has its target value.

        Returns:
            The values, and in words the limits on sizes that ended the way there.
        """
        direction = np.zeros_like(values)
        free = [index for index in dimension.by if index not in fixed]
        direction[free] = values[free]
        for _ in range(20):
            gap = target - self._measure(dimension, values)
            if abs(gap) <= 1e-9 * abs(target):
                break
            slope = self._slope(dimension, values, direction)
            if abs(slope) < 1e-6 * abs(target):
                raise InvalidRequest(
                    "dimension_fixed",
                    f"{dimension.name} can't be changed: nothing that moves it is free",
                    "Leave out the edits of "
                    + ", ".join(self.template.names[index] for index in dimension.by)
                    + ", or of this dimension.",
                )
            step = direction * (gap / slope)
            share = self._bounds.furthest(values, step)
            if share < 1.0:
                return values + share * step, self._bounds.broken(values + step)
            values = values + step
        return values, []

    def _slope(self, dimension: Derived, values: Array, direction: Array) -> float:
        if dimension.row is not None:
            return float(dimension.row[1:] @ direction)
        if self.jacobian is None:
            return 0.0
        axis = "xyz".index(dimension.extent or "x")
        coordinates = self._coordinates(dimension, values)
        ends = self.jacobian[[coordinates.argmax(), coordinates.argmin()], axis] @ direction
        return float(ends[0] - ends[1])


def _require_positive(name: str, value: float) -> None:
    if value <= 0.0:
        raise InvalidRequest(
            "size_not_positive",
            f"{name} would be {value:.4g}",
            "Sizes must stay positive: choose a larger value.",
        )


def _refused(outcome: Outcome) -> InvalidRequest:
    (name, (asked, found)), *_ = outcome.adjusted.items()
    if not outcome.limits:
        fault = "the edits contradict each other"
    else:
        fault = f"{', '.join(outcome.limits)} would not be kept"
    return InvalidRequest(
        "edit_out_of_bounds",
        f"{name} can't be {asked:.4g}: {fault}",
        f"The nearest that can be had is {found:.4g}; strict=false takes it.",
    )
