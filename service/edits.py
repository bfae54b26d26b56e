"""Edits as clients send them: a JSON object of parameter names and changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, cast

from service.errors import InvalidRequest
from service.namedentries import number_fault, read_entries

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
    return changes(read_entries(text, "edits", FORM))


def changes(entries: Mapping[str, Any]) -> dict[str, Change]:
    """What an edits object says.

    Raises:
        InvalidRequest: ``edit_malformed``, for what is no change.
    """
    return {name: _change(name, entry) for name, entry in entries.items()}


def _change(name: str, entry: Any) -> Change:
    if isinstance(entry, dict):
        if len(entry) != 1 or next(iter(entry)) not in KINDS:
            found = repr(", ".join(entry)[:80]) if entry else "nothing"
            raise _malformed(name, f"has {found}, not one of set, add, scale")
        kind, amount = next(iter(entry.items()))
    else:
        kind, amount = "set", entry
    if (fault := number_fault(amount)) is not None:
        raise _malformed(name, fault)
    return Change(cast(Kind, kind), float(amount))


def _malformed(name: str, fault: str) -> InvalidRequest:
    return InvalidRequest("edit_malformed", f"the change of {name[:80]!r} {fault}", FORM)
