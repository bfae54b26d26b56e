"""Numbers with units, as people type them: ``45cm``, ``18in``, ``5ft11in``, ``30deg``, ``120%``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

Kind = Literal["plain", "length", "angle", "percent"]

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Length of each unit of the service, in metres."""
RADIANS = {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0}

_PART = r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[A-Za-z%°]*)"
_ONE = re.compile(_PART)
_FEET_AND_INCHES = re.compile(r"(?P<feet>[+-]?\d+)\s*ft\s*(?P<inches>\d+\.?\d*|\.\d+)\s*in")


@dataclass(frozen=True)
class Quantity:
    """A number and what it measures.

    Attributes:
        value: metres of a length, radians of an angle, 1.2 for 120 %, else the number as it stands.
        kind: what it is of.
    """

    value: float
    kind: Kind = "plain"

    def number(self, units: str) -> float:
        """What to send to a service that is told ``units``; plain numbers are in those already."""
        return self.value / METRES[units] if self.kind == "length" else self.value


def read_quantity(text: str) -> Quantity:
    """The quantity that a text is.

    Raises:
        ValueError: when it is none; the message goes on from the text.
    """
    text = text.strip()
    if both := _FEET_AND_INCHES.fullmatch(text):
        sign = -1.0 if both["feet"].startswith("-") else 1.0
        inches = 12.0 * abs(int(both["feet"])) + float(both["inches"])
        return Quantity(sign * inches * METRES["in"], "length")
    found = _ONE.fullmatch(text)
    if found is None:
        raise ValueError("is no number, such as 0.45, 45cm, 18in, 30deg or 120%")
    value, unit = float(found["number"]), found["unit"].lower()
    if not abs(value) < 1e12:
        raise ValueError("is no number of sensible size")
    if not unit:
        return Quantity(value)
    if unit == "%":
        return Quantity(value / 100.0, "percent")
    if unit in METRES:
        return Quantity(value * METRES[unit], "length")
    if unit in RADIANS:
        return Quantity(value * RADIANS[unit], "angle")
    raise ValueError(
        f"has the unit {unit!r}, which is none of {', '.join((*METRES, 'rad, deg, %'))}"
    )
