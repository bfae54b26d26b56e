"""Server-sent events, read from chunks that may end anywhere."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Message:
    """An event as it came.

    Attributes:
        id: the last that was told, None before any.
        event: its kind.
        data: its lines.
    """

    id: str | None
    event: str
    data: str


class Parser:
    """Takes chunks, and gives the events that they complete.

    Attributes:
        retry_ms: after how long to come again when the stream ends; None before that was told.
    """

    def __init__(self) -> None:
        self._text = codecs.getincrementaldecoder("utf-8-sig")("replace")
        self._rest = ""
        self._id: str | None = None
        self.retry_ms: int | None = None
        self._clear()

    def _clear(self) -> None:
        self._event = "message"
        self._data: list[str] = []

    def feed(self, chunk: bytes) -> Iterator[Message]:
        """The events that this chunk completes."""
        text = self._rest + self._text.decode(chunk)
        # A CR at the end may be half of a CRLF.
        held = text.endswith("\r")
        lines = (text[:-1] if held else text).replace("\r\n", "\n").replace("\r", "\n").split("\n")
        self._rest = lines.pop() + ("\r" if held else "")
        for line in lines:
            if line:
                self._take(line)
            elif self._data:
                yield Message(self._id, self._event, "\n".join(self._data))
                self._clear()
            else:
                self._clear()

    def _take(self, line: str) -> None:
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if name == "data":
            self._data.append(value)
        elif name == "event":
            self._event = value
        elif name == "id" and "\0" not in value:
            self._id = value
        elif name == "retry" and value.isascii() and value.isdigit():
            self.retry_ms = int(value[:9])
