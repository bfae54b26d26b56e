"""Which version of each category's model is served by default, as a setting says it."""

from __future__ import annotations

from collections.abc import Mapping


def named_versions(value: str | Mapping[str, str]) -> dict[str, str]:
    """Versions by category.

    Args:
        value: they, or their text, such as ``chair=1.0.0,human=1.1.0``.

    Raises:
        ValueError: for an entry of another form, or two of one category.
    """
    if not isinstance(value, str):
        return dict(value)
    versions: dict[str, str] = {}
    for entry in filter(None, map(str.strip, value.split(","))):
        name, _, version = (part.strip() for part in entry.partition("="))
        if not name or not version:
            raise ValueError(f"{entry!r} is not of the form CATEGORY=VERSION, as chair=1.0.0 is")
        if name in versions:
            raise ValueError(f"{name} is named twice")
        versions[name] = version
    return versions
