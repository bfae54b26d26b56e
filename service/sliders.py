"""A mesh with its editing inside: what every kind of category has in common."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.errors import InvalidRequest
from service.inference import Inference
from service.mesh.stretch import Stretch
from service.mesh.targets import Displacements, Target
from service.namedentries import require_known
from service.requests import UNITS, file_unit

FARTHER = (0.7, 1.4)
"""A slider reaches at least from and to these parts of a size, wherever it lies typically."""
FARTHEST = (0.5, 2.0)
"""The same for a size that is not typical: a toy's, or one in other units."""


@dataclass(frozen=True)
class Slider:
    """A parameter that users may move.

    Attributes:
        name, label, group, unit, kind, step: as `GET /categories` says them.
        value, sigma: as inferred, in the unit.
        low, high: how far it may be moved; the value is in between.
    """

    name: str
    label: str
    group: str
    unit: str
    kind: str
    step: float
    value: float
    sigma: float
    low: float
    high: float

    @classmethod
    def of(
        cls, entry: Mapping[str, Any], value: float, sigma: float, ends: tuple[float, float]
    ) -> Slider:
        """The slider of a parameter.

        Args:
            entry: what `GET /categories` says of it, in the unit.
            value, sigma: as inferred.
            ends: how far it may be moved, but that the value is always in between.
        """
        said = {name: entry[name] for name in ("name", "label", "group", "unit", "kind", "step")}
        low, high = min(ends[0], value), max(ends[1], value)
        return cls(**said, value=value, sigma=sigma, low=low, high=high)

    @property
    def change(self) -> float:
        """What a weight of 1 adds: the way to the upper end, or to the lower where that is all."""
        return self.high - self.value or self.low - self.value

    def report(self) -> dict[str, Any]:
        """What is told of it."""
        return {
            "label": self.label,
            "group": self.group,
            "unit": self.unit,
            "kind": self.kind,
            "value": self.value,
            "sigma": self.sigma,
            "range": [self.low, self.high],
            "step": self.step,
        }


def chosen(names: Sequence[str], wanted: Sequence[str] | None, category: str) -> list[str]:
    """The parameters to offer, in the category's order.

    Raises:
        InvalidRequest: ``unknown_parameter``, or ``parameters_empty``.
    """
    if wanted is None:
        return list(names)
    require_known(category, wanted, names)
    if not wanted:
        raise InvalidRequest(
            "parameters_empty",
            "parameters names none",
            f"Name some of {', '.join(names)}, or leave it out for all.",
        )
    return [name for name in names if name in wanted]


def size_range(value: float, typical: tuple[float, float]) -> tuple[float, float]:
    """How far a size may be moved: over what is typical, and some way from where it is."""
    low, high = typical
    near = FARTHER if low <= value <= high else FARTHEST
    return min(low, near[0] * value), max(high, near[1] * value)


def targets_of(
    slider: Slider, shift: Displacements, stretch: Stretch, paired: bool
) -> Iterator[Target]:
    """The morph targets of a slider.

    Args:
        slider: of the parameter.
        shift, stretch: ``[V, 3]`` and ``[V]`` for a unit of the parameter; see `Target`.
        paired: one up and one down, each with weights from 0 to 1.
    """
    change = slider.change
    ways = [("", change)]
    if paired:
        ends = (("+", slider.high - slider.value), ("-", slider.low - slider.value))
        ways = [(sign, way) for sign, way in ends if way]
    for sign, way in ways:
        name = slider.name + sign
        extras = {
            "name": name,
            "parameter": slider.name,
            "label": slider.label,
            "group": slider.group,
            "unit": slider.unit,
            "value": slider.value,
            "range": [slider.low, slider.high],
            "change": way,
        }
        yield Target(name, extras, shift * way, stretch.scaled(way))


def notes(
    found: Inference,
    keep: str,
    sliders: Sequence[Slider],
    further: dict[str, Any],
) -> dict[str, Any]:
    """What is said of the whole, for ``asset.extras``: a frontend needs no other answer."""
    report = found.report()
    metres = file_unit(found.mesh.format, found.unit)
    return {
        "shape_parameters": {
            "mesh_id": found.upload.mesh_id,
            "category": found.model.name,
            "keep": keep,
            "unit": found.unit,
            "metres_per_unit": UNITS[found.unit],
            "metres_per_file_unit": metres,
            "parameters": {slider.name: slider.report() for slider in sliders},
            **further,
            "frame": report["frame"],
            "fit": report["fit"],
            "model": report["model"],
            "warnings": report["warnings"],
        }
    }
