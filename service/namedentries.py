"""JSON objects of names and entries in form fields: `edits`, `constraints`."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

from service.errors import InvalidRequest


def read_entries(text: str, field: str, form: str) -> dict[str, Any]:
    """A field's entries by name.

    Args:
        text: of the field.
        field: its name, for the errors: ``<field>_not_json`` and ``<field>_not_object``.
        form: the suggestion, what to write instead.

    Raises:
        InvalidRequest: when the text is not JSON, or not an object.
    """
    entries = read_json(text, field, form)
    if not isinstance(entries, dict):
        fault = f"{field} is a {kind_of(entries)}, not an object"
        raise InvalidRequest(f"{field}_not_object", fault, form)
    return entries


def read_json(text: str, field: str, form: str) -> Any:
    """A field's JSON, in which no name stands twice in one object.

    Raises:
        InvalidRequest: ``<field>_not_json``.
    """
    try:
        return json.loads(text, parse_constant=_refuse, object_pairs_hook=_unique)
    except (ValueError, RecursionError) as error:
        raise InvalidRequest(
            f"{field}_not_json", f"{field} can't be read: {error}", form
        ) from error


def number_fault(value: Any) -> str | None:
    """What keeps an entry's value from being a number of sensible size; None if nothing does."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"is a {kind_of(value)}, not a number"
    if not abs(value) < 1e12 or not math.isfinite(value):
        return "is not a finite number of sensible size"
    return None


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not a number in JSON")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    entries = dict(pairs)
    if len(entries) != len(pairs):
        raise ValueError("a name stands twice in one object")
    return entries


def kind_of(value: Any) -> str:
    """What JSON calls a value."""
    names = {dict: "object", list: "list", str: "text", bool: "truth value", type(None): "null"}
    return names.get(type(value), "number")


def require_known(category: str, named: Iterable[str], known: Sequence[str]) -> None:
    """Raise `InvalidRequest` (``unknown_parameter``) for a name that a category does not have."""
    unknown = [name for name in named if name not in known]
    if unknown:
        raise InvalidRequest(
            "unknown_parameter",
            f"{category} has no parameter {unknown[0][:80]!r}",
            f"Known are {', '.join(known)}.",
        )
