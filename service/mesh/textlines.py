"""Text formats as lines and tokens, each known by its byte span in the file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.mesh import limits
from service.mesh.faults import malformed, quoted
from service.mesh.polygons import Indices

Bytes = NDArray[np.uint8]

NEWLINE, RETURN, HASH, BACKSLASH = b"\n\r#\\"
# Every byte up to the space counts as white space.
SPACE = ord(" ")
# Indentation is stripped a column at a time up to here, then a line at a time.
COLUMNS = 64
# Bytes are searched by so many: one search of all would keep other threads waiting.
BLOCK = 1 << 20
TOKEN = re.compile(rb"[^\x00- ]+")


class TextLines:
    """The lines of a text file.

    Attributes:
        format: the name used in messages.
        data: the file as it came.
        starts: ``[L]`` offset of each line's first character that is not white space.
        ends: ``[L]`` offset of each line's newline (or the file's end).
    """

    def __init__(self, format: str, data: bytes, continued: bool = False) -> None:
        """Find the lines; with `continued`, a backslash before a newline joins two lines."""
        self.format = format
        limits.check_lines(occurrences(data, b"\n"))
        self.data = data
        text = data
        if continued and (holds(text, b"\\\n") or holds(text, b"\\\r\n")):
            text = joined(text)
        if b"\r" in text:
            text = text.replace(b"\r", b" " if b"\n" in text else b"\n")
        # As long as the file, plus room to compare a keyword at the last line. Copied by numpy,
        # which lets other threads run meanwhile.
        self.bytes: Bytes = np.empty(len(text) + 16, np.uint8)
        self.bytes[: len(text)] = np.frombuffer(text, np.uint8)
        self.bytes[len(text) :] = NEWLINE
        self.bytes.flags.writeable = False
        newlines = np.flatnonzero(self.bytes[: len(data)] == NEWLINE)
        self.ends: Indices = np.append(newlines, len(data))
        self.starts: Indices = self._indented(np.append(0, newlines + 1))

    def _indented(self, starts: Indices) -> Indices:
        pending = np.arange(len(starts))
        for _ in range(COLUMNS):
            at = starts[pending]
            pending = pending[(at < self.ends[pending]) & (self.bytes[at] <= SPACE)]
            if len(pending) == 0:
                return starts
            starts[pending] += 1
        for line in pending.tolist():
            visible = np.flatnonzero(self.bytes[starts[line] : self.ends[line]] > SPACE)
            starts[line] = starts[line] + visible[0] if len(visible) else self.ends[line]
        return starts

    def beginning(self, *keywords: bytes) -> tuple[Indices, Indices]:
        """Lines whose first tokens are `keywords` (lower case, but any case fits).

        Returns:
            ``[N]`` their numbers, and ``[N]`` the offsets behind the last keyword.
        """
        lines = np.arange(len(self.starts))
        at = self.starts
        for keyword in keywords:
            at = self._visible(at)
            fits = at < self.ends[lines]
            for offset, letter in enumerate(keyword):
                byte = self._at(at + offset)
                fits &= (byte == letter) | (byte == letter - 32)
            fits &= self._at(at + len(keyword)) <= SPACE
            lines, at = lines[fits], at[fits] + len(keyword)
        return lines, at

    def _at(self, offsets: Indices) -> Bytes:
        return self.bytes[np.minimum(offsets, len(self.bytes) - 1)]

    def _visible(self, at: Indices) -> Indices:
        """The offsets moved past a few blanks."""
        at = at.copy()
        for _ in range(COLUMNS):
            blank = (self.bytes[at] <= SPACE) & (self.bytes[at] != NEWLINE)
            if not blank.any():
                break
            at[blank] += 1
        return at

    def filled(self) -> Indices:
        """Numbers of the lines that hold more than white space or a ``#`` comment."""
        first = self.bytes[self.starts]
        return np.flatnonzero((self.starts < self.ends) & (first != HASH))

    def tokens(self, lines: Indices, at: Indices | None = None) -> Tokens:
        """The tokens of some `lines` (ascending), from offset `at` of each line on."""
        ends = self.ends[lines]
        starts = self.starts[lines] if at is None else np.minimum(at, ends)
        keywords = starts - self.starts[lines]
        # Neighbouring lines are copied together: files keep their lines of a kind in long runs.
        breaks = np.flatnonzero(np.diff(lines) != 1) + 1
        heads = np.append(0, breaks) if len(lines) else breaks
        tails = np.append(breaks, len(lines)) - 1 if len(lines) else breaks
        spans = zip(starts[heads].tolist(), (ends[tails] + 1).tolist(), strict=True)
        gathered = np.concatenate([self.bytes[a:b] for a, b in spans] or [self.bytes[:0]])
        # Within a run the next line's keyword is part of the copy: blank it.
        lead = starts - np.append(starts[:1], ends[:-1] + 1)
        lead[heads] = 0
        begins = np.cumsum(lead + (ends + 1 - starts)) - (ends + 1 - starts)
        for back in range(1, int(keywords.max(initial=0)) + 1):
            gathered[(begins - back)[np.minimum(lead, keywords) >= back]] = SPACE
        if HASH in gathered:
            gathered = without_comments(gathered)
        return Tokens(self.format, gathered, begins, starts)


def occurrences(data: bytes, letter: bytes) -> int:
    """How often a single character is in it."""
    return sum(data.count(letter, at, at + BLOCK) for at in range(0, len(data), BLOCK))


def holds(data: bytes, token: bytes) -> bool:
    """Whether the token is in it."""
    more = BLOCK + len(token) - 1
    return any(data.find(token, at, at + more) >= 0 for at in range(0, len(data), BLOCK))


def joined(data: bytes) -> bytes:
    """`data` with the ends of lines that go on blanked; a comment may well end in a backslash."""
    text = np.frombuffer(data, np.uint8).copy()
    ends = np.flatnonzero(text == NEWLINE)
    marks = np.maximum(ends - 1 - (text[ends - 1] == RETURN), 0)
    hashes = np.flatnonzero(text == HASH)
    before = np.searchsorted(hashes, ends)
    commented = np.diff(before, prepend=0) > 0
    going_on = (text[marks] == BACKSLASH) & ~commented
    for places in (ends, ends - 1, marks):
        text[places[going_on]] = SPACE
    return text.tobytes()


def without_comments(text: Bytes) -> Bytes:
    """`text` with everything from a ``#`` to its line's end blanked."""
    order = np.arange(len(text))
    line = np.maximum.accumulate(np.where(text == NEWLINE, order, -1))
    comment = np.maximum.accumulate(np.where(text == HASH, order, -1))
    return np.where((comment > line) & (text != NEWLINE), np.uint8(SPACE), text)


@dataclass(frozen=True)
class Tokens:
    """Tokens of chosen lines.

    Attributes:
        format: the name used in messages.
        text: the lines' bytes, gathered.
        begins: ``[L]`` where each line begins in `text`.
        places: ``[L]`` where each line begins in the file.
    """

    format: str
    text: Bytes
    begins: Indices
    places: Indices

    @cached_property
    def edges(self) -> Indices:
        """``[2 T]`` where each token starts and ends in `text`."""
        return token_edges(self.text)

    @cached_property
    def first(self) -> Indices:
        """``[L]`` index of each line's first token."""
        return np.searchsorted(self.edges[::2], self.begins)

    @cached_property
    def counts(self) -> Indices:
        """``[L]`` tokens on each line."""
        return np.diff(self.first, append=len(self.edges) // 2)

    def spans(self, tokens: Indices) -> tuple[Indices, Indices]:
        """Start and end in the file of some `tokens`, of any shape."""
        starts, ends = self.edges[::2][tokens], self.edges[1::2][tokens]
        line = np.searchsorted(self.begins, starts, side="right") - 1
        shift = (self.places - self.begins)[line]
        return starts + shift, ends + shift

    def numbers(self, dtype: type = np.float64) -> NDArray[np.float64]:
        """``[T]`` all tokens as numbers of `dtype`; InvalidMesh where one is none."""
        return numbers(self.format, self.text, len(self.edges) // 2, dtype)


def token_edges(text: Bytes) -> Indices:
    """``[2 T]`` start, end, start, end ... of the T tokens of `text`."""
    edges = np.flatnonzero(np.diff(text > SPACE, prepend=False, append=False))
    limits.check_tokens(len(edges) // 2)
    return edges


def numbers(format: str, text: Bytes, count: int, dtype: type) -> NDArray[np.float64]:
    """``[count]`` numbers from white-space separated `text`; InvalidMesh if it holds others."""
    deadline.check()
    if count == 0:
        return np.empty(0, dtype)
    try:
        parsed: NDArray[Any] = np.fromstring(text.tobytes(), dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        parsed = np.empty(0, dtype)
    # A token that is two numbers to the parser ("1-2") gives more numbers than tokens.
    if len(parsed) != count:
        raise malformed(format, f"it has {first_other(text)} where a number should be")
    return parsed


def first_other(text: Bytes) -> str:
    """The first token that is no number, quoted, for a message."""
    for match in TOKEN.finditer(text.tobytes()):
        try:
            float(match[0])
        except ValueError:
            return quoted(match[0][:80].decode("latin-1"))
    return "text"
