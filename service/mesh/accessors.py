"""glTF accessors: typed arrays inside buffers, plain, interleaved, quantised or sparse."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from service.mesh import limits
from service.mesh.document import COMPRESSED, Document, Object, compressed
from service.mesh.faults import quoted
from service.mesh.polygons import Indices

COMPONENTS: Mapping[int, str] = {
    5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4",
}  # fmt: skip
WIDTHS: Mapping[str, int] = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
FLOAT = 5126

Stored = NDArray[Any]
Values = NDArray[np.float64]


class Bytes(Protocol):
    """Buffers by index: as read, or as they are about to be written."""

    def __getitem__(self, index: int) -> bytearray | memoryview: ...


@dataclass(frozen=True)
class Span:
    """Where an array of elements lies in a buffer; `stride` bytes from one to the next."""

    buffer: int
    offset: int
    stride: int
    count: int

    def array(self, content: bytearray | memoryview, dtype: np.dtype[Any], width: int) -> Stored:
        """``[count, width]`` view of the elements in the buffer's `content`."""
        strides = (self.stride, dtype.itemsize)
        return np.ndarray((self.count, width), dtype, content, self.offset, strides)


@dataclass(frozen=True)
class Accessor:
    """One accessor, located and checked.

    Attributes:
        index: its number in the document.
        entry: its JSON.
        dtype: of the stored components, little-endian.
        width: components an element.
        count: elements.
        normalized: stored integers stand for fractions of their largest value.
        span: where the elements lie; None when all are zero.
        sparse: which elements are stored apart, ascending, and where those lie.
    """

    index: int
    entry: Object
    dtype: np.dtype[Any]
    width: int
    count: int
    normalized: bool
    span: Span | None
    sparse: tuple[Indices, Span] | None

    @property
    def spans(self) -> list[Span]:
        """All bytes that elements lie in."""
        found = [self.span] if self.span else []
        return [*found, self.sparse[1]] if self.sparse else found

    def stored(self, buffers: Bytes) -> Stored:
        """``[count, width]`` elements as stored; a view where nothing is sparse."""
        if self.span is None:
            base = np.zeros((self.count, self.width), self.dtype)
        else:
            base = self.span.array(buffers[self.span.buffer], self.dtype, self.width)
        if self.sparse is None:
            return base
        rows, span = self.sparse
        base = base.copy()
        base[rows] = span.array(buffers[span.buffer], self.dtype, self.width)
        return base

    def decode(self, stored: Stored) -> Values:
        """Float64 values of `stored` elements."""
        values = stored.astype(np.float64)
        if self.normalized:
            values /= np.iinfo(self.dtype).max
            np.maximum(values, -1.0, out=values)
        return values

    def encode(self, values: Values) -> Stored | None:
        """`values` as stored; None where integers can't hold one."""
        if self.dtype.kind == "f":
            return values.astype(self.dtype)
        info = np.iinfo(self.dtype)
        steps = np.rint(values * info.max if self.normalized else values)
        if steps.size and not (info.min <= steps.min() and steps.max() <= info.max):
            return None
        return steps.astype(self.dtype)


def read_accessor(document: Document, buffers: Bytes, index: Any) -> Accessor:
    """Locate accessor `index`; InvalidMesh where it leaves its buffer or breaks a rule."""
    entry = document.entry("accessors", index)
    component, kind = entry.get("componentType"), entry.get("type")
    if not isinstance(component, int) or component not in COMPONENTS:
        raise document.wrong(f"accessors[{index}] has the componentType {quoted(component)}")
    if not isinstance(kind, str) or kind not in WIDTHS:
        raise document.wrong(f"accessors[{index}] has the type {quoted(kind)}")
    dtype, width = np.dtype(COMPONENTS[component]), WIDTHS[kind]
    count = document.natural(entry, "count")
    size = dtype.itemsize * width
    span = None
    if "bufferView" in entry:
        span = _span(document, buffers, entry, count, size)
    else:
        limits.check_vertices(count)
    sparse = _sparse(document, buffers, entry, count, size) if "sparse" in entry else None
    normalized = entry.get("normalized") is True and dtype.kind != "f"
    return Accessor(index, entry, dtype, width, count, normalized, span, sparse)


def sharing_bytes(accessors: Iterable[Accessor]) -> set[int]:
    """Numbers of the accessors that may lie in bytes of another, interleaved ones among them."""
    spans = sorted(
        (
            s.buffer,
            s.offset,
            s.offset + s.stride * (s.count - 1) + a.dtype.itemsize * a.width,
            a.index,
        )
        for a in accessors
        for s in a.spans
    )
    found: set[int] = set()
    cluster: list[int] = []
    last, end = -1, 0
    for buffer, start, stop, index in spans:
        if buffer != last or start >= end:
            cluster = []
            last, end = buffer, stop
        cluster.append(index)
        end = max(end, stop)
        if len(cluster) > 1:
            found.update(cluster[-2:])
    return found


def _span(document: Document, buffers: Bytes, part: Object, count: int, size: int) -> Span:
    """Where `count` elements of `size` bytes lie that a JSON `part` refers to."""
    view = document.entry("bufferViews", part["bufferView"])
    for name in document.object(view, "extensions"):
        if name in COMPRESSED:
            raise compressed(name)
    start, length = document.natural(view, "byteOffset", 0), document.natural(view, "byteLength")
    offset = document.natural(part, "byteOffset", 0)
    stride = document.natural(view, "byteStride", size)
    where = f"bufferViews[{part['bufferView']}]"
    if stride < size:
        raise document.wrong(f"{where} has a byteStride of {stride} for elements of {size} bytes")
    if offset + stride * (count - 1) + size > length:
        raise document.wrong(f"{where} is too short for the {count} elements in it")
    buffer = document.natural(view, "buffer")
    if start + length > len(buffers[buffer]):
        raise document.wrong(f"{where} leaves buffers[{buffer}]")
    return Span(buffer, start + offset, stride, count)


def _sparse(
    document: Document, buffers: Bytes, entry: Object, count: int, size: int
) -> tuple[Indices, Span]:
    sparse = document.object(entry, "sparse")
    places, values = document.object(sparse, "indices"), document.object(sparse, "values")
    number = document.natural(sparse, "count")
    component = places.get("componentType")
    if component not in (5121, 5123, 5125) or "bufferView" not in places:
        raise document.wrong("a sparse accessor has no usable indices")
    if "bufferView" not in values:
        raise document.wrong("a sparse accessor has no values")
    dtype = np.dtype(COMPONENTS[component])
    span = _span(document, buffers, places, number, dtype.itemsize)
    rows = span.array(buffers[span.buffer], dtype, 1)[:, 0].astype(np.int64)
    if len(rows) and (rows[-1] >= count or (np.diff(rows) <= 0).any()):
        raise document.wrong("the indices of a sparse accessor do not ascend within its elements")
    return rows, _span(document, buffers, values, number, size)
