"""Log lines: plain ones for people, one JSON object a line for machines.

A line that is written while a request is worked on carries its ids, from whatever thread.  What
clients send can't forge a line: control characters are escaped, and what is long is cut.
"""

from __future__ import annotations

import json
import logging
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal, TextIO

LogFormat = Literal["auto", "text", "json"]

FIELDS = "fields"
"""Name of the `extra` that holds a line's further fields, a mapping of values that JSON has."""

LONGEST = 8000
"""Characters of a message or of a traceback's end that are kept: collectors cut at 16 KiB."""

# Line ends and terminal sequences, in ASCII and beyond.
_CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]")

_encode = json.JSONEncoder(separators=(",", ":"), default=str).encode


@dataclass(frozen=True)
class Identity:
    """Which request a line belongs to; `span_id` is empty where its trace is not kept."""

    trace_id: str
    request_id: str
    span_id: str = ""

    @property
    def sampled(self) -> bool:
        """Whether the trace is kept."""
        return bool(self.span_id)


_current: ContextVar[Identity | None] = ContextVar("identity", default=None)


@contextmanager
def about(identity: Identity) -> Iterator[None]:
    """Lines that are written within the block belong to this request."""
    token = _current.set(identity)
    try:
        yield
    finally:
        _current.reset(token)


def configure(level: str, form: LogFormat = "auto", stream: TextIO | None = None) -> None:
    """Send all lines of at least this level to a stream, by default standard error."""
    stream = stream or sys.stderr
    if form == "auto":
        form = "text" if stream.isatty() else "json"
    handler = logging.StreamHandler(stream)
    handler.addFilter(_identify)
    handler.setFormatter(Json() if form == "json" else Text())
    logging.basicConfig(level=level.upper(), handlers=[handler])
    logging.captureWarnings(True)
    # It warns of each malformed body, which the client is told of.
    logging.getLogger("python_multipart").setLevel(logging.ERROR)


def _identify(record: logging.LogRecord) -> bool:
    record.identity = _current.get()
    return True


def plain(text: str, longest: int = LONGEST) -> str:
    """The text on one line, cut where it is too long."""
    cut = text if len(text) <= longest else text[: longest - 3] + "..."
    return _CONTROLS.sub(lambda match: f"\\x{ord(match[0]):02x}", cut)


def _stamp(record: logging.LogRecord) -> str:
    """RFC 3339, in UTC, to the millisecond."""
    moment = datetime.fromtimestamp(record.created, UTC)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")


class Json(logging.Formatter):
    """One object a line, in ASCII; README and docs tell the names of its members."""

    def format(self, record: logging.LogRecord) -> str:
        line: dict[str, Any] = {
            "timestamp": _stamp(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage()[:LONGEST],
        }
        identity: Identity | None = getattr(record, "identity", None)
        if identity is not None:
            line |= {name: value for name, value in vars(identity).items() if value}
        line |= getattr(record, FIELDS, {})
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)[-LONGEST:]
        return _encode(line)


class Text(logging.Formatter):
    """When, how bad, where from and what; a traceback follows, indented."""

    def format(self, record: logging.LogRecord) -> str:
        line = f"{_stamp(record)} {record.levelname} {record.name}: {plain(record.getMessage())}"
        identity: Identity | None = getattr(record, "identity", None)
        if identity is not None:
            line += f" [{identity.trace_id}]"
        if record.exc_info:
            trace = self.formatException(record.exc_info)[-LONGEST:]
            line += "".join(f"\n    {plain(row)}" for row in trace.splitlines())
        return line
