"""Edits and constraints: what is to become of which parameter."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

Value = float | Mapping[str, float]
"""A number, which sets, or one of the objects that the functions here make."""

Values = Mapping[str, Value]
"""By name of the parameter or derived dimension."""


def set_to(value: float) -> dict[str, float]:
    """Exactly this, in the upload's unit; as an edit or a constraint."""
    return {"set": value}


def add(value: float) -> dict[str, float]:
    """An edit: so much more, or less where it is negative."""
    return {"add": value}


def scale(factor: float) -> dict[str, float]:
    """An edit: so many times as much."""
    return {"scale": factor}


def at_least(value: float) -> dict[str, float]:
    """A constraint: not below this."""
    return {"min": value}


def at_most(value: float) -> dict[str, float]:
    """A constraint: not above this."""
    return {"max": value}


def between(low: float, high: float) -> dict[str, float]:
    """A constraint: neither below `low` nor above `high`."""
    return {"min": low, "max": high}


def as_json(values: object) -> str:
    """What a form field holds of edits or constraints; a text passes as it is.

    Raises:
        ValueError: when a number is not finite.
        TypeError: when something is no number, mapping or list.
    """
    return values if isinstance(values, str) else json.dumps(_plain(values))


def _plain(value: object) -> object:
    """JSON's own types of it; numpy's numbers come as floats."""
    if isinstance(value, Mapping):
        return {str(name): _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, bool | str | bytes) or not hasattr(value, "__float__"):
        raise TypeError(f"{value!r} is no number")
    if not math.isfinite(number := float(value)):
        raise ValueError(f"{number} is not finite")
    return number
