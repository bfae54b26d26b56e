"""The categories that come with the service, and which of them are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

SHIPPED = Path(__file__).parent / "models"
"""The folder of their models."""
DEBUG = "debug"
"""The one that is served only when it is asked for: it is for clients' own tests."""
NONE = "none"
"""Asks for none of them."""


def shipped_categories() -> tuple[str, ...]:
    """Their names, sorted."""
    return tuple(sorted(card.stem for card in SHIPPED.glob("*.json")))


def usual_categories() -> tuple[str, ...]:
    """Those that are served where nothing else is asked for."""
    return tuple(name for name in shipped_categories() if name != DEBUG)


def asked_categories(value: str | Sequence[str]) -> tuple[str, ...]:
    """The categories that a setting names.

    Args:
        value: names, or their text with commas between; an empty text is the usual ones, and
            ``none`` is none.

    Raises:
        ValueError: for a name that none of them has.
    """
    given = value.split(",") if isinstance(value, str) else value
    names = tuple(dict.fromkeys(name.strip() for name in given if name.strip()))
    if names == (NONE,):
        return ()
    known = shipped_categories()
    for name in names:
        if name not in known:
            raise ValueError(
                f"{name!r} does not come with the service; name some of {', '.join(known)}, "
                f"or {NONE}"
            )
    return names if names or not isinstance(value, str) else usual_categories()
