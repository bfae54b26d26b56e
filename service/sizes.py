"""Whether an upload is as large as its kind is, or its unit must be another one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.requests import METRIC, UNITS
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

LENIENT = 2.5
"""Shapes may be so many times smaller or larger than typical ones without remark."""
STATURE, ADULT = 1.65, 1.35
"""Metres that adults are tall, and how many times smaller or taller they may be without remark:
from 1.22 to 2.23 m."""
CHILD = 0.45, 1.22
"""Metres that children are tall who are noticeably shorter."""

WORDS = {"in": "inches", "ft": "feet"}
"""Units whose symbols read as other words."""


def size_ratio(template: AffineTemplate, metres: Array) -> float:
    """How large a shape is beside typical ones: 1 is ordinary, 1000 is millimetres for metres.

    Args:
        template: the category's.
        metres: ``[d]`` its parameters.
    """
    low, high = np.array([parameter.typical for parameter in template.parameters]).T
    counted = template.public & (low > 0.0)
    middle = np.sqrt(np.where(counted, low * high, 1.0))
    # Large lengths tell the size; thicknesses and signed offsets only the proportions.
    weight = np.where(counted, middle, 0.0)
    return float(np.exp(weight @ np.log(np.maximum(metres, 1e-12) / middle) / weight.sum()))


def size_warning(template: AffineTemplate, metres: Array, format: str, unit: str) -> str | None:
    """What to tell a client whose upload is implausibly small or large for its kind.

    Args:
        template: the category's.
        metres: ``[d]`` its parameters as the file's unit has them.
        format: the file's.
        unit: that the client says, or is taken to say.
    """
    spread = max(high / low for low, high in _typical(template)) ** 0.5
    ratio = size_ratio(template, metres)
    return _warning(template.name, ratio, LENIENT * spread, format, unit)


def stature_warning(name: str, metres: float, format: str, unit: str) -> str | None:
    """The same for a body of a stature in metres, as the file's unit has it."""
    warning = _warning(name, metres / STATURE, ADULT, format, unit)
    if warning is not None and CHILD[0] < metres < CHILD[1]:
        return f"{warning}; or it is a child, whose proportions the body has none of"
    return warning


def _warning(name: str, ratio: float, lenient: float, format: str, unit: str) -> str | None:
    """What to say of a shape that is ``ratio`` times as large as usual, if that is more than
    ``lenient`` times too large or too small."""
    if 1.0 / lenient <= ratio <= lenient:
        return None
    told = "metres" if format in METRIC else unit
    article = "an" if name[0] in "aeiou" else "a"
    times = f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.2g}"
    start = (
        f"{article} {name} of this size would be {times} times as large as usual, "
        f"with {told} as the unit of the file"
    )
    factor = UNITS["m" if format in METRIC else unit]
    others = {
        name: abs(np.log(ratio * length / factor))
        for name, length in UNITS.items()
        if length != factor
    }
    likely = min(others, key=lambda name: others[name])
    if others[likely] > np.log(lenient):
        return f"{start}; its scale may be arbitrary: lengths are in {told} all the same"
    guess = f"{start}; it seems to be in {WORDS.get(likely, likely)}"
    if format in METRIC:
        return f"{guess}, but its format's unit is the metre"
    return f"{guess}: say units={likely}"


def _typical(template: AffineTemplate) -> list[tuple[float, float]]:
    return [
        parameter.typical
        for parameter, counted in zip(template.parameters, template.public, strict=True)
        if counted and parameter.typical[0] > 0.0
    ]
