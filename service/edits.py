"""Edits as clients send them: a JSON object of parameter names and changes."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Literal, cast

from service.errors import InvalidRequest

Kind = Literal["set", "add", "scale"]
KINDS: tuple[Kind, ...] = ("set", "add", "scale")
FORM = 'Write an object such as {"seat_width": {"scale": 1.2}, "seat_top_height": 0.45}.'


@dataclass(frozen=True)
class Change:
    """What to do to one value: set it, add to it, or scale it."""

    kind: Kind
    amount: float

    def apply(self, value: float) -> float:
        """The value after the change."""
        if self.kind == "set":
            return self.amount
        return value + self.amount if self.kind == "add" else value * self.amount


def parse_edits(text: str) -> dict[str, Change]:
    """Read the form field ``edits``.

    Raises:
        InvalidRequest: when the text is not JSON, or not an object of names and changes.
    """
    try:
        entries = json.loads(text, parse_constant=_refuse, object_pairs_hook=_unique)
    except (ValueError, RecursionError) as error:
        raise InvalidRequest("edits_not_json", f"edits can't be read: {error}", FORM) from error
    if not isinstance(entries, dict):
        fault = f"edits is a {_kind_of(entries)}, not an object"
        raise InvalidRequest("edits_not_object", fault, FORM)
    return {name: _change(name, entry) for name, entry in entries.items()}


def _change(name: str, entry: Any) -> Change:
    if isinstance(entry, dict):
        if len(entry) != 1 or next(iter(entry)) not in KINDS:
            found = repr(", ".join(entry)[:80]) if entry else "nothing"
            raise _malformed(name, f"has {found}, not one of set, add, scale")
        kind, amount = next(iter(entry.items()))
    else:
        kind, amount = "set", entry
    if isinstance(amount, bool) or not isinstance(amount, int | float):
        raise _malformed(name, f"is a {_kind_of(amount)}, not a number")
    if not abs(amount) < 1e12 or not math.isfinite(amount):
        raise _malformed(name, "is not a finite number of sensible size")
    return Change(cast(Kind, kind), float(amount))


def _malformed(name: str, fault: str) -> InvalidRequest:
    return InvalidRequest("edit_malformed", f"the change of {name[:80]!r} {fault}", FORM)


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not a number in JSON")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    entries = dict(pairs)
    if len(entries) != len(pairs):
        raise ValueError("a name stands twice in one object")
    return entries


def _kind_of(value: Any) -> str:
    names = {dict: "object", list: "list", str: "text", bool: "truth value", type(None): "null"}
    return names.get(type(value), "number")
