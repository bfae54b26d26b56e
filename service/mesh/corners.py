"""The corners ``v/vt/vn`` of OBJ faces."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.mesh import limits
from service.mesh.faults import malformed
from service.mesh.polygons import Indices
from service.mesh.textlines import SPACE, Bytes, TextLines, Tokens, numbers

SLASH = ord("/")
POSITION, TEXTURE, NORMAL = 0, 1, 2


class Corners:
    """All corners of all faces, in order.

    Attributes:
        counts: ``[P]`` corners of each face.
        lines: ``[P]`` the line of each.
    """

    def __init__(self, lines: TextLines) -> None:
        """Parse the ``f`` lines; InvalidMesh where one holds anything but corners."""
        self.lines, at = lines.beginning(b"f")
        tokens = lines.tokens(self.lines, at)
        self.counts: Indices = tokens.counts
        limits.check_faces(int(np.maximum(self.counts - 2, 0).sum()))
        self._mixed: Tokens | None = None
        self._fields: dict[int, NDArray[Any]] = uniform_fields(tokens.text, tokens.edges)
        if not self._fields:
            self._mixed = tokens
            self._parse(POSITION)
            self._parse(NORMAL)

    def _parse(self, field: int) -> None:
        if self._mixed is not None and field not in self._fields:
            self._fields[field] = mixed_field(self._mixed.text, self._mixed.edges, field)

    def indices(self, field: int, targets: Indices) -> Indices:
        """``[C]`` zero-based indices of each corner; -1 where it has no such field.

        Args:
            field: `POSITION`, `TEXTURE` or `NORMAL`.
            targets: ``[N]`` line numbers of what is counted: negative indices count back from
                the face's line.

        Raises:
            InvalidMesh: an index is 0, or counts back too far; or, of `TEXTURE`, is none.
        """
        self._parse(field)
        found = self._fields.get(field)
        if found is None:
            return np.full(self.counts.sum(), -1)
        given = found != MISSING
        if len(found) == 0 or found.min() > 0:
            return np.where(given, found - 1, -1)
        line = np.repeat(self.lines, self.counts)
        absolute = np.where(found < 0, np.searchsorted(targets, line) + found, found - 1)
        wrong = given & (absolute < 0)
        if wrong.any():
            at = int(line[np.argmax(wrong)]) + 1
            raise malformed("obj", f"line {at} has an index that points at nothing")
        return np.where(given, absolute, -1)


# Stands for a field that a corner doesn't have; no file counts so far.
MISSING = np.iinfo(np.int64).max


def uniform_fields(text: Bytes, edges: Indices) -> dict[int, NDArray[Any]]:
    """``[C]`` indices of each field if all corners are written alike; else nothing.

    Args:
        text: the face lines.
        edges: ``[2 C]`` where each corner starts and ends in `text`.
    """
    starts, ends = edges[::2], edges[1::2]
    count = len(starts)
    slashes = np.flatnonzero(text == SLASH)
    each = len(slashes) // max(count, 1)
    if each > 2 or each * count != len(slashes):
        return {}
    places = slashes.reshape(count, each)
    if ((places <= starts[:, None]) | (places >= ends[:, None])).any():
        return {}
    blanked = np.where(text == SLASH, np.uint8(SPACE), text)
    # Of two slashes both, or none, may stand side by side.
    double = places[:, 1] - places[:, 0] == 1 if each == 2 else np.zeros(count, bool)
    fields = {0: (0,), 1: (0, 1), 2: (0, 2) if double.any() else (0, 1, 2)}[each]
    last = ends - places[:, -1] == 1 if each else double
    if double.any() != double.all() or last.any():
        return {}
    table = numbers("obj", blanked, count * len(fields), np.int64).reshape(count, len(fields))
    return {field: table[:, column] for column, field in enumerate(fields)}


def mixed_field(text: Bytes, edges: Indices, field: int) -> Indices:
    """``[C]`` indices of one `field`, or `MISSING`; arguments as for `uniform_fields`."""
    starts, ends = edges[::2], edges[1::2]
    slashes = np.append(np.flatnonzero(text == SLASH), len(text))
    first = np.searchsorted(slashes, starts)
    bound = [starts - 1]
    for rank in range(field + 1):
        following = slashes[np.minimum(first + rank, len(slashes) - 1)]
        bound.append(np.where(following < ends, following, ends))
    begins, finishes = np.minimum(bound[-2] + 1, ends), bound[-1]
    present = finishes > begins
    result = np.full(len(starts), MISSING)
    kept = np.full(len(text), SPACE, np.uint8)
    lengths = (finishes - begins)[present]
    step = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    spots = np.repeat(begins[present], lengths) + step
    kept[spots] = text[spots]
    result[present] = numbers("obj", kept, int(present.sum()), np.int64)
    return result
