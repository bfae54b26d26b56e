"""From changes of parameters and derived dimensions to the parameters after an edit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from service.edits import Change
from service.errors import InvalidRequest
from service.template.affine import AffineTemplate
from service.template.parameters import Derived

Array = NDArray[np.float64]


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

    def derived(self, parameters: Array) -> dict[str, float]:
        """Derived dimensions of the mesh once its parameters are ``parameters [d]``."""
        return {n: self._measure(d, parameters) for n, d in self.template.derived.items()}

    def after(self, changes: Mapping[str, Change]) -> Array:
        """Parameters ``[d]`` after the changes.

        Parameters change first.  A derived dimension then moves those of the parameters behind it
        that were not named themselves, each in proportion to its value.

        Raises:
            InvalidRequest: for an unknown name, a size that would not be positive, or a derived
                dimension that nothing is left to change by.
        """
        names, derived = self.template.names, self.template.derived
        unknown = [name for name in changes if name not in names and name not in derived]
        if unknown:
            raise InvalidRequest(
                "unknown_parameter",
                f"{self.template.name} has no parameter {unknown[0][:80]!r}",
                f"Known are {', '.join([*names, *derived])}.",
            )
        before = self.derived(self.parameters)
        values = self.parameters.copy()
        fixed: set[int] = set()
        for index, name in enumerate(names):
            if name in changes:
                values[index] = changes[name].apply(values[index])
                fixed.add(index)
        _require_positive(self.template, values)
        # Extents last: the mesh is measured once all else has moved.
        for name in sorted(derived, key=lambda n: derived[n].extent is not None):
            if name in changes:
                target = changes[name].apply(before[name])
                values = self._reach(derived[name], target, values, fixed)
                fixed.update(derived[name].by)
        return values

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

    def _reach(self, dimension: Derived, target: float, values: Array, fixed: set[int]) -> Array:
        """Scale the parameters behind a dimension until it has its target value."""
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
            values = values + direction * (gap / slope)
            _require_positive(self.template, values, dimension.name)
        return values

    def _slope(self, dimension: Derived, values: Array, direction: Array) -> float:
        if dimension.row is not None:
            return float(dimension.row[1:] @ direction)
        if self.jacobian is None:
            return 0.0
        axis = "xyz".index(dimension.extent or "x")
        coordinates = self._coordinates(dimension, values)
        ends = self.jacobian[[coordinates.argmax(), coordinates.argmin()], axis] @ direction
        return float(ends[0] - ends[1])


def _require_positive(template: AffineTemplate, values: Array, cause: str = "") -> None:
    for name, value in zip(template.names, values, strict=True):
        if value <= 0.0:
            raise InvalidRequest(
                "size_not_positive",
                f"{name} would be {value:.4g}" + (f" for that {cause}" if cause else ""),
                "Sizes must stay positive: choose a larger value.",
            )
