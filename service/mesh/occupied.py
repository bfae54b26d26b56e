"""Bytes of glTF buffers that must stay because accessors other than the moved ones lie there."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable

from service.errors import ShapeError
from service.mesh.accessors import Accessor, Bytes, Span, read_accessor
from service.mesh.document import Document


class Occupied:
    """The bytes of some accessors; those that can't be located have none."""

    def __init__(self, document: Document, buffers: Bytes, accessors: Iterable[int]) -> None:
        spans: list[tuple[Span, int]] = []
        for index in accessors:
            try:
                accessor = read_accessor(document, buffers, index)
            except ShapeError:
                continue
            spans += [(span, element_size(accessor)) for span in accessor.spans]
        self._spans = sorted(spans, key=lambda item: (item[0].buffer, item[0].offset))
        self._starts = [(span.buffer, span.offset) for span, _ in self._spans]
        # Where the spans up to each one end at the latest, in its buffer.
        self._reach: list[int] = []
        last = -1
        for span, size in self._spans:
            earlier = self._reach[-1] if span.buffer == last else 0
            self._reach.append(max(earlier, _end(span, size)))
            last = span.buffer

    def meets(self, span: Span, size: int) -> bool:
        """Whether elements of `size` bytes in `span` have any of the bytes."""
        at = bisect_left(self._starts, (span.buffer, _end(span, size)))
        while at > 0 and self._spans[at - 1][0].buffer == span.buffer:
            at -= 1
            if self._reach[at] <= span.offset:
                return False
            if _meet(span, size, *self._spans[at]):
                return True
        return False


def element_size(accessor: Accessor) -> int:
    """Bytes of one element."""
    return accessor.dtype.itemsize * accessor.width


def _end(span: Span, size: int) -> int:
    """The byte behind the last of a span's elements of `size` bytes."""
    return span.offset + span.stride * (span.count - 1) + size if span.count else span.offset


def _meet(one: Span, one_size: int, two: Span, two_size: int) -> bool:
    if one.buffer != two.buffer or not one.count or not two.count:
        return False
    if _end(one, one_size) <= two.offset or _end(two, two_size) <= one.offset:
        return False
    # Interleaved arrays take turns.
    shift = (two.offset - one.offset) % one.stride
    return one.stride != two.stride or shift < one_size or one.stride - shift < two_size
