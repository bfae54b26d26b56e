"""Derived dimensions as the fit has them and as the mesh itself measures them.

The two differ by what the fit is off.  What a client asks for in absolute terms - a seat at 45 cm -
is a matter of the mesh; what it asks for in relative ones starts, for the client, from the value
that it was told, and for the mesh from its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.bound import Columns
from service.deform.gauges import Gauge, Heights
from service.deform.measured import Level
from service.edits import Change
from service.template.affine import AffineTemplate
from service.template.parameters import Derived

Array = NDArray[np.float64]

SAME = 1e-6
"""Share of a value within which one that is set is the one that was told: no change."""
APART = 1 / 3
"""Share of its value by which the fit may be off for the mesh's own measure to be gone by.  Beyond,
they may mean different things; measured by hand, the mesh's own was right as far as this."""
FOLLOWS = (0.7, 1.4)
"""How far the mesh's own measure moves, at least and at most, where the fit's moves by 1."""
STEP = 0.25
"""The share of the parameters by which that is tried, up and down."""


@dataclass(frozen=True)
class Aim:
    """Where a change of a dimension leads.

    Attributes:
        target: the value to tell of.
        goal: the gauge's, when it is reached.
        offset, factor: the value to tell of is ``offset + factor * gauge``.
    """

    target: float
    goal: float
    offset: float = 0.0
    factor: float = 1.0

    def told(self, gauge: float) -> float:
        """The value to tell of for what the gauge has come to."""
        return self.offset + self.factor * gauge


@dataclass(frozen=True)
class Reading:
    """A derived dimension of a mesh.

    Attributes:
        dimension: the template's.
        fitted: its value, as it was told before the edit.
        gauge: what edits and constraints of it go by.
        mesh: what the mesh itself measures; None where that can't be told.
        by: indices of the parameters that setting it changes: the template's, but where the mesh
            does not follow those (a seat that is solid to the floor has no legs to grow), all that
            are behind it.
    """

    dimension: Derived
    fitted: float
    gauge: Gauge
    mesh: Gauge | None
    by: tuple[int, ...]

    @property
    def corrects(self) -> bool:
        """Whether the mesh's own measure stands in for the fit's."""
        return self.dimension.row is not None and self.gauge is self.mesh

    def aim(self, change: Change, still: Array) -> Aim:
        """What a change of it aims at; ``still [d]`` is no change of the parameters."""
        target = change.apply(self.fitted)
        if not self.corrects:
            return Aim(target, target)
        measured = self.gauge.value(still)
        if change.kind == "scale":
            return Aim(target, measured * change.amount, 0.0, self.fitted / measured)
        if change.kind == "set" and abs(target - self.fitted) > SAME * abs(self.fitted):
            return Aim(target, target)
        return Aim(target, measured + target - self.fitted, self.fitted - measured)


def read(
    template: AffineTemplate,
    parameters: Array,
    vertices: Array,
    scale: float,
    columns: Columns,
    levels: Mapping[str, Level],
) -> dict[str, Reading]:
    """The derived dimensions of a mesh by name; the arguments are those of `Dimensions`."""

    def along(axis: int) -> Heights:
        own = {index: column for (along, index), column in columns.items() if along == axis}
        return Heights(vertices[:, axis] / scale, own)

    found = {}
    for name, dimension in template.derived.items():
        if dimension.row is None:
            ends = along("xyz".index(dimension.extent or "x"))
            gauge = Gauge(ends, ends)
            fitted = gauge.value(np.zeros_like(parameters))
            found[name] = Reading(dimension, fitted, gauge, gauge, dimension.by)
            continue
        fitted = float(dimension.row[0] + dimension.row[1:] @ parameters)
        gauge = Gauge.affine(fitted, dimension.row[1:])
        mesh = None
        if name in levels:
            floor, level = along(1), levels[name]
            rises = {index: level.of(column)[None] for index, column in floor.columns.items()}
            mesh = Gauge(Heights(level.of(floor.values)[None], rises), floor)
            behind = np.flatnonzero((dimension.row[1:] != 0.0) & template.public).tolist()
            way = _followed(gauge, mesh, (dimension.by, behind), parameters)
            if way is not None:
                found[name] = Reading(dimension, fitted, mesh, mesh, way)
                continue
        found[name] = Reading(dimension, fitted, gauge, mesh, dimension.by)
    return found


def _followed(
    fit: Gauge, mesh: Gauge, ways: Sequence[Sequence[int]], parameters: Array
) -> tuple[int, ...] | None:
    """The first of the ways, each indices of parameters, by which the mesh's own measure moves as
    the fit's does; None when there is none, or when the mesh measures something else."""
    still = np.zeros_like(parameters)
    fitted, measured = fit.value(still), mesh.value(still)
    if abs(measured - fitted) > APART * abs(fitted):
        return None
    for way in ways:
        step = np.zeros_like(parameters)
        step[list(way)] = STEP * parameters[list(way)]
        moved = [
            (mesh.value(change) - measured) / (fit.value(change) - fitted)
            for change in (-step, step)
        ]
        if FOLLOWS[0] <= min(moved) and max(moved) <= FOLLOWS[1]:
            return tuple(way)
    return None
