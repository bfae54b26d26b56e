"""Constraints as clients send them: a JSON object of names and the intervals to keep to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from service.errors import InvalidRequest
from service.namedentries import number_fault, read_entries

KINDS = ("set", "min", "max")
FORM = (
    'Write an object such as {"seat_top_height": 0.45, "total_width": {"max": 0.6}, '
    '"seat_depth": {"min": 0.4, "max": 0.5}}.'
)


@dataclass(frozen=True)
class Interval:
    """Where a value is to lie: ends included, infinite where there is none, equal for a number."""

    low: float = -math.inf
    high: float = math.inf

    @property
    def asked(self) -> dict[str, float]:
        """The same as clients write it: ``set``, or ``min``, ``max`` or both."""
        if self.low == self.high:
            return {"set": self.low}
        ends = {"min": self.low, "max": self.high}
        return {kind: end for kind, end in ends.items() if math.isfinite(end)}

    def told(self, unit: str) -> str:
        """The same in words: ``at most 0.6 m``."""
        words = {"set": "at", "min": "at least", "max": "at most"}
        parts = [f"{words[kind]} {end:.4g}" for kind, end in self.asked.items()]
        return " and ".join(parts) + ("" if unit == "1" else f" {unit}")


NONE: Mapping[str, Interval] = MappingProxyType({})
"""No constraints."""


def parse_constraints(text: str) -> dict[str, Interval]:
    """Read the form field ``constraints``.

    Raises:
        InvalidRequest: when the text is not JSON, or not an object of names and intervals.
    """
    entries = read_entries(text, "constraints", FORM)
    return {name: _interval(name, entry) for name, entry in entries.items()}


def _interval(name: str, entry: Any) -> Interval:
    ends = entry if isinstance(entry, dict) else {"set": entry}
    if not ends or not set(ends) <= set(KINDS) or ("set" in ends and len(ends) > 1):
        found = repr(", ".join(ends)[:80]) if ends else "nothing"
        raise _malformed(name, f"has {found}, not set, or min, max or both")
    for end in ends.values():
        if (fault := number_fault(end)) is not None:
            raise _malformed(name, fault)
    if "set" in ends:
        return Interval(float(ends["set"]), float(ends["set"]))
    return Interval(float(ends.get("min", -math.inf)), float(ends.get("max", math.inf)))


def _malformed(name: str, fault: str) -> InvalidRequest:
    return InvalidRequest("constraint_malformed", f"the constraint of {name[:80]!r} {fault}", FORM)
