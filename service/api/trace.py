"""The ids of a request, from its headers or fresh, as every answer names them.

A trace's id is that of `traceparent` (W3C Trace Context), and all calls of one task share it; a
request's own is that of `X-Request-Id`, as proxies send it.
"""

from __future__ import annotations

import re
import secrets

TRACE_HEADER = "Trace-Id"
REQUEST_HEADER = "X-Request-Id"

# Later versions may append fields; version 00 has exactly four.
_TRACEPARENT = re.compile(
    "(?P<version>[0-9a-f]{2})-(?P<trace>[0-9a-f]{32})-(?P<parent>[0-9a-f]{16})-[0-9a-f]{2}"
    "(?P<rest>-.*)?"
)
_REQUEST_ID = re.compile("[A-Za-z0-9][A-Za-z0-9._:/+=@-]{0,127}")


def trace_id(traceparent: str | None) -> str:
    """32 hex digits: the header's trace id where it is valid, else fresh ones."""
    match = _TRACEPARENT.fullmatch(traceparent.strip()) if traceparent else None
    if match and _valid(match):
        return match["trace"]
    return secrets.token_hex(16)


def _valid(match: re.Match[str]) -> bool:
    version = match["version"]
    return (
        version != "ff"
        and int(match["trace"], 16) != 0
        and int(match["parent"], 16) != 0
        and not (version == "00" and match["rest"])
    )


def request_id(given: str | None) -> str:
    """The header's value where it is one that can't do harm, else 32 fresh hex digits."""
    if given and _REQUEST_ID.fullmatch(given):
        return given
    return secrets.token_hex(16)
