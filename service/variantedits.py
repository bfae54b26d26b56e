"""Several edits of one mesh as clients send them: a JSON array of edits objects."""

from __future__ import annotations

from math import isinf
from typing import Any

from service.errors import InvalidRequest
from service.namedentries import kind_of, read_json

MOST = 1000
"""Variants in one request."""
FORM = (
    'Write an array of edits objects such as [{"seat_width": {"scale": 1.2}}, '
    '{"seat_width": 0.5, "leg_height": 0.4}].'
)


def parse_variants(text: str) -> list[dict[str, Any]]:
    """Read the form field ``variants``.

    What the objects hold is left as it is: one that makes no sense spoils its own variant alone.

    Raises:
        InvalidRequest: when the text is not JSON (``variants_not_json``), not an array of edits
            objects or an empty one (``variants_malformed``), or of more than `MOST`
            (``variants_too_many``).
    """
    found = read_json(text, "variants", FORM)
    if not isinstance(found, list):
        raise _malformed(f"variants is a {kind_of(found)}, not an array")
    if not found:
        raise _malformed("variants is an empty array")
    if len(found) > MOST:
        raise InvalidRequest(
            "variants_too_many",
            f"variants holds {len(found)}, more than {MOST}",
            f"Send at most {MOST} at a time.",
        )
    for index, entry in enumerate(found):
        if not isinstance(entry, dict):
            raise _malformed(f"variant {index} is a {kind_of(entry)}, not an object")
        if not all(map(_is_flat, entry.values())):
            raise _malformed(f"variant {index} holds what no change is")
    return found


def _is_flat(change: Any) -> bool:
    """Whether it may be told back: neither nested, however deep, nor a number that JSON lacks."""
    values = change.values() if isinstance(change, dict) else (change,)
    return all(
        not isinstance(value, dict | list) and not (isinstance(value, float) and isinf(value))
        for value in values
    )


def _malformed(fault: str) -> InvalidRequest:
    return InvalidRequest("variants_malformed", fault, FORM)
