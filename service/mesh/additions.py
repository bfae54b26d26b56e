"""What is added to a glTF asset: objects to its arrays, bytes to a buffer, each at the end."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.mesh.accessors import COMPONENTS, WIDTHS
from service.mesh.bounds import bounds
from service.mesh.buffers import Draft
from service.mesh.document import Document, Object
from service.mesh.jsontext import END, Path

VERTEX_DATA = 34962

Elements = NDArray[Any]


class Additions:
    """Collects what is added; numbers go on where the asset's own end."""

    def __init__(self, document: Document, draft: Draft) -> None:
        self.draft = draft
        self._document = document
        self._added: dict[str, list[Object]] = defaultdict(list)
        self._known: dict[Any, int] = {}

    def add(self, kind: str, entry: Object) -> int:
        """Add an object to the top-level array `kind`; returns its number there."""
        self._added[kind].append(entry)
        return len(self._document.array(self._document.root, kind)) + len(self._added[kind]) - 1

    def once(self, kind: str, entry: Object) -> int:
        """As `add`, but an object that was added so before is not added again."""
        key = (kind, repr(entry))
        if key not in self._known:
            self._known[key] = self.add(kind, entry)
        return self._known[key]

    def view(self, content: bytes, buffer: int = 0, **members: Any) -> int:
        """A buffer view of `content`; of what was added before, the one that is there."""
        key = ("view", content, buffer, *sorted(members.items()))
        if key not in self._known:
            offset = self.draft.append(buffer, content)
            entry = {"buffer": buffer, "byteOffset": offset, "byteLength": len(content), **members}
            self._known[key] = self.add("bufferViews", entry)
        return self._known[key]

    def elements_view(self, elements: Elements, buffer: int = 0, target: int | None = None) -> int:
        """A buffer view of ``[N, C]`` `elements`, little-endian.

        For vertices, rows that are no whole number of four bytes are padded.
        """
        size = elements.shape[1] * elements.itemsize
        stride = size + -size % 4 if target == VERTEX_DATA else size
        padded = np.zeros((len(elements), stride), np.uint8)
        padded[:, :size] = np.ascontiguousarray(elements).view(np.uint8).reshape(-1, size)
        members: Object = {"byteStride": stride} if stride != size else {}
        if target is not None:
            members["target"] = target
        return self.view(padded.tobytes(), buffer, **members)

    def accessor(self, elements: Elements, target: int | None = None, **members: Any) -> int:
        """An accessor of ``[N, C]`` `elements`; see `elements_view`; `members` are more JSON."""
        view = self.elements_view(elements, target=target)
        return self.once("accessors", {"bufferView": view, **_typed(elements), **members})

    def sparse(
        self, rows: NDArray[np.int64], elements: Elements, count: int, **members: Any
    ) -> int:
        """An accessor of `count` elements that are zero but for some `rows`, at least one."""
        kind = "<u2" if count <= 1 << 16 else "<u4"
        indices = {
            "bufferView": self.view(rows.astype(kind).tobytes()),
            "componentType": _component(np.dtype(kind)),
        }
        values = {"bufferView": self.view(np.ascontiguousarray(elements).tobytes())}
        sparse = {"count": len(rows), "indices": indices, "values": values}
        return self.once(
            "accessors", {**_typed(elements), "count": count, "sparse": sparse, **members}
        )

    def zeros(self, elements: Elements, count: int, **members: Any) -> int:
        """An accessor of `count` zeros like `elements`; it takes no bytes."""
        return self.once("accessors", {**_typed(elements), "count": count, **members})

    def edits(self) -> dict[Path, Any]:
        """The JSON values to set, as `jsontext.splice` takes them."""
        return {
            (kind, END) if kind in self._document.root else (kind,): entries
            for kind, entries in self._added.items()
        }


def box(elements: Elements) -> Object:
    """The members ``min`` and ``max`` of an accessor of ``[N, C]`` elements, N > 0."""
    low, high = bounds(elements)
    return {"min": low.tolist(), "max": high.tolist()}


def _typed(elements: Elements) -> Object:
    kind = next(kind for kind, width in WIDTHS.items() if width == elements.shape[1])
    return {
        "componentType": _component(elements.dtype),
        "count": len(elements),
        "type": kind,
    }


def _component(dtype: np.dtype[Any]) -> int:
    name = dtype.newbyteorder("<").str.replace("|", "<")
    return next(component for component, known in COMPONENTS.items() if known == name)
