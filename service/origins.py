"""Web origins as a setting names them (RFC 6454): `https://shapes.example`, or `*` for all."""

from __future__ import annotations

import re
from typing import Any

ALL = "*"

# Ports that browsers leave out.
_USUAL = {"http": "80", "https": "443"}

_ORIGIN = re.compile(
    r"(?P<scheme>[a-z][a-z0-9+.-]*)://(?P<host>[a-z0-9._-]+|\[[0-9a-f:.]+\])(?::(?P<port>\d{1,5}))?"
)


def origins(value: Any) -> Any:
    """The origins in a text with commas between, as browsers write them.

    Raises:
        ValueError: for what is no origin, and for `*` beside others.
    """
    parts = value.split(",") if isinstance(value, str) else value
    found = tuple(dict.fromkeys(_origin(part.strip()) for part in parts if part.strip()))
    if ALL in found and len(found) > 1:
        raise ValueError("`*` lets in every origin: leave out the others, or it")
    return found


def _origin(text: str) -> str:
    if text == ALL:
        return text
    match = _ORIGIN.fullmatch(text.lower().removesuffix("/"))
    if match is None:
        raise ValueError(
            f"{text!r} is no origin: write scheme and host, and the port if it is not the usual "
            "one, as in https://shapes.example:8443"
        )
    scheme, host, port = match["scheme"], match["host"], match["port"]
    if port is None or port == _USUAL.get(scheme):
        return f"{scheme}://{host}"
    return f"{scheme}://{host}:{port}"
