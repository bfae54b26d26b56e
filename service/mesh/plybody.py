"""The rows of a PLY element as columns that know their place in the file."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.errors import InvalidMesh
from service.mesh.faults import malformed
from service.mesh.plyheader import Element
from service.mesh.polygons import Indices

Column = NDArray[np.generic]

# Rows between two looks at the clock.
STRIDE = 1 << 16


@dataclass(frozen=True)
class Lists:
    """A list property: `counts` ``[N]`` and its `values`, one row's after the other's."""

    counts: Indices
    values: Column


@dataclass(frozen=True)
class Rows:
    """The rows of one element.

    Attributes:
        element: what the header says of them.
        scalars: column ``[N]`` of each scalar property.
        lists: each list property.
        places: for each scalar property, ``[N]`` byte offsets of its values.
        end: the byte after the last row.
    """

    element: Element
    scalars: dict[str, Column]
    lists: dict[str, Lists]
    places: dict[str, Indices]
    end: int


@dataclass(frozen=True)
class Layout:
    """Where rows start, how long each of their lists is, and their size where all have one."""

    starts: Indices
    lengths: list[Indices]
    end: int
    stride: int | None = None


def as_doubles(element: Element) -> Element:
    """`element` as it lies in an ASCII body whose tokens were all parsed to float64."""
    double = np.dtype(np.float64)
    properties = tuple(
        replace(item, value=double, count=None if item.count is None else double)
        for item in element.properties
    )
    return replace(element, properties=properties)


def read_rows(element: Element, data: memoryview, start: int) -> Rows:
    """Rows of `element` from byte `start`; InvalidMesh when the file is too short for them."""
    if element.count * element.smallest_row > len(data) - start:
        raise cut_short(element)
    rows = Rows(element, {}, {}, {}, start)
    if element.smallest_row == 0:
        return rows
    layout = _as_first(element, data, start) or _one_by_one(element, data, start)
    at, lengths = layout.starts, iter(layout.lengths)
    for item in element.properties:
        if item.count is None:
            rows.places[item.name] = at
            rows.scalars[item.name] = _fetch(data, at, item.value, layout.stride)
            at = at + item.value.itemsize
            continue
        counts = next(lengths)
        at = at + item.count.itemsize
        rows.lists[item.name] = Lists(counts, _fetch_lists(data, at, item.value, counts, layout))
        at = at + counts * item.value.itemsize
    return replace(rows, end=layout.end)


def cut_short(element: Element) -> InvalidMesh:
    """The error for a body that ends too early."""
    return malformed("ply", f"it ends within its {element.count} {element.name!r} rows")


def _as_first(element: Element, data: memoryview, start: int) -> Layout | None:
    """The layout if every row's lists are as long as the first row's, else None."""
    stride, offsets, lengths = 0, [], []
    for item in element.properties:
        if item.count is not None:
            offsets.append((stride, item.count))
            lengths.append(
                _length(data, start + stride, item.count, element) if element.count else 0
            )
            stride += item.count.itemsize + lengths[-1] * item.value.itemsize
        else:
            stride += item.value.itemsize
    end = start + element.count * stride
    if end > len(data):
        return None
    starts = start + np.arange(element.count) * stride
    for (offset, dtype), length in zip(offsets, lengths, strict=True):
        if (_fetch(data, starts + offset, dtype, stride) != length).any():
            return None
    counts = [np.full(element.count, length) for length in lengths]
    return Layout(starts, counts, end, stride)


def _one_by_one(element: Element, data: memoryview, start: int) -> Layout:
    """The layout by stepping from row to row."""
    if [item.count for item in element.properties if item.count] == [np.dtype(np.uint8)]:
        return _by_table(element, data, start)
    starts: list[int] = []
    lengths: list[list[int]] = [[] for item in element.properties if item.count is not None]
    at = start
    for row in range(element.count):
        if row % STRIDE == 0:
            deadline.check()
        starts.append(at)
        found = iter(lengths)
        for item in element.properties:
            if item.count is None:
                at += item.value.itemsize
            else:
                length = _length(data, at, item.count, element)
                next(found).append(length)
                at += item.count.itemsize + length * item.value.itemsize
    if at > len(data):
        raise cut_short(element)
    return Layout(np.array(starts), [np.array(found, np.int64) for found in lengths], at)


def _by_table(element: Element, data: memoryview, start: int) -> Layout:
    """`_one_by_one` for rows of one list whose length is a byte, as nearly all files have them."""
    before = [item.count is None for item in element.properties].index(False)
    lead = sum(item.value.itemsize for item in element.properties[:before])
    size = element.properties[before].value.itemsize
    smallest = element.smallest_row
    steps = [smallest + length * size for length in range(256)]
    starts: list[int] = []
    at = start
    try:
        for _ in range(element.count):
            starts.append(at)
            at += steps[data[at + lead]]
    except IndexError:
        raise cut_short(element) from None
    if at > len(data):
        raise cut_short(element)
    placed = np.array(starts, np.int64)
    lengths = np.frombuffer(data, np.uint8)[placed + lead].astype(np.int64)
    return Layout(placed, [lengths], at)


def _length(data: memoryview, at: int, dtype: np.dtype[np.generic], element: Element) -> int:
    """The length of the list at byte `at`."""
    if at + dtype.itemsize > len(data):
        raise cut_short(element)
    order = ">" if dtype.byteorder == ">" else "<"
    length = struct.unpack_from(order + dtype.char, data, at)[0]
    if not 0 <= length <= len(data):
        raise malformed("ply", f"a row of {element.name!r} has a list of length {length}")
    return int(length)


def _fetch(
    data: memoryview, at: Indices, dtype: np.dtype[np.generic], stride: int | None
) -> Column:
    """``[N]`` values at byte offsets `at`, which are `stride` apart or anywhere."""
    if len(at) == 0:
        return np.empty(0, dtype)
    if stride is not None:
        return np.ndarray((len(at),), dtype, data, int(at[0]), (stride,))
    spread = np.frombuffer(data, np.uint8)[at[:, None] + np.arange(dtype.itemsize)]
    column: Column = spread.view(dtype)[:, 0]
    return column


def _fetch_lists(
    data: memoryview, at: Indices, dtype: np.dtype[np.generic], counts: Indices, layout: Layout
) -> Column:
    """The items of lists of `counts` items that begin at byte offsets `at`."""
    if layout.stride is not None and len(at):
        shape, strides = (len(at), int(counts[0])), (layout.stride, dtype.itemsize)
        return np.ndarray(shape, dtype, data, int(at[0]), strides).reshape(-1)
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return _fetch(data, np.repeat(at, counts) + step * dtype.itemsize, dtype, None)
