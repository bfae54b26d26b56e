"""Lists of names in a form field: with commas between, or as a JSON array."""

from __future__ import annotations

import json

from service.errors import InvalidRequest


def parse_names(text: str) -> tuple[str, ...]:
    """The names, in order; none for an empty text.

    Raises:
        InvalidRequest: ``names_malformed``, for what begins like an array and is none of texts.
    """
    if not text.lstrip().startswith("["):
        return tuple(name.strip() for name in text.split(",") if name.strip())
    try:
        names = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _malformed(f"can't be read: {error}") from error
    if not all(isinstance(name, str) for name in names):
        raise _malformed("holds something that is no text")
    return tuple(names)


def _malformed(fault: str) -> InvalidRequest:
    return InvalidRequest(
        "names_malformed",
        f"the list of parameters {fault}",
        'Write seat_width,leg_height or ["seat_width", "leg_height"].',
    )
