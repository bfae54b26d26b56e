"""Constraints that can't be met together, told to the client."""

from __future__ import annotations

from collections.abc import Callable

from service.deform.demands import Conflict, Unsatisfiable
from service.errors import InvalidRequest


def conflict_error(found: Unsatisfiable, unit_of: Callable[[str], str]) -> InvalidRequest:
    """The error for them: what conflicts in words, and in the member ``conflicts`` for programs.

    Args:
        found: the conflict.
        unit_of: the unit of a parameter or dimension.
    """
    asked = [f"{c.name} {c.interval.told(unit_of(c.name))}" for c in found.conflicts]
    nearest = [_nearest(conflict, unit_of(conflict.name)) for conflict in found.conflicts]
    entries = [
        {
            "name": conflict.name,
            "asked": conflict.interval.asked,
            "nearest": conflict.nearest,
            "by": conflict.by,
            "unit": unit_of(conflict.name),
        }
        for conflict in found.conflicts
    ]
    together = " together" if len(asked) > 1 else ""
    return InvalidRequest(
        "constraints_conflict",
        f"{' and '.join(asked)} can't be had{together}{_against(found)}",
        f"The nearest that can be had{together}: {'; '.join(nearest)}. Ask for that, or leave out "
        "one of those that conflict.",
        {"conflicts": entries},
    )


def _against(found: Unsatisfiable) -> str:
    parts = [f"the edit of {', '.join(found.held)} stays"] if found.held else []
    parts += [f"{', '.join(found.limits)} must be kept"] if found.limits else []
    if not parts and len(found.conflicts) == 1:
        parts = ["no parameter moves it any further"]
    return f": {' and '.join(parts)}" if parts else ""


def _nearest(conflict: Conflict, unit: str) -> str:
    unit = "" if unit == "1" else f" {unit}"
    return f"{conflict.name} {conflict.nearest:.6g}{unit} (off by {conflict.by:.3g}{unit})"
