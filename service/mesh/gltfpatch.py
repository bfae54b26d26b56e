"""Moved vertices back into a glTF asset's buffers, with the least change to its JSON.

Values are written in place.  An accessor gets storage of its own, at the end of its buffer, only
where that can't be: integers that can't hold a new value, sparse elements that were not stored,
bytes that another accessor uses otherwise, and instances of a mesh that no longer look the same.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.mesh.accessors import FLOAT, Accessor, Stored, Values, sharing_bytes
from service.mesh.additions import VERTEX_DATA, Additions
from service.mesh.bounds import bounds, same_bound
from service.mesh.buffers import Buffers, Draft
from service.mesh.document import Document, Object
from service.mesh.geometry import NORMAL, POSITION, Geometry, Use
from service.mesh.jsontext import Path
from service.mesh.meshcopies import Repointing, pinned_accessors
from service.mesh.moves import Moves
from service.mesh.occupied import Occupied, element_size
from service.mesh.polygons import Indices

# Instances agree when their local values differ by less than this part of their size.
AGREEMENT = 1e-6

Rows = Indices | slice


@dataclass
class Content:
    """What an accessor shall hold: new x, y, z in some `rows`, for some of its `uses`."""

    rows: Rows
    values: Values
    uses: list[Use]

    @property
    def stays(self) -> bool:
        return len(self.values) == 0

    def full(self, old: Values) -> Values:
        """All elements, given those that were."""
        result = old.copy()
        result[self.rows, :3] = self.values
        return result

    def agrees(self, other: Content, old: Values) -> bool:
        """Whether the two hold the same but for rounding."""
        if self.stays or other.stays:
            return self.stays and other.stays
        one, two = self.full(old), other.full(old)
        low, high = bounds(one)
        return bool(np.abs(one - two).max() <= AGREEMENT * (high - low).max())

    def cells(self, old: Values) -> bytes:
        """The cells of a grid that the values lie in: alike for contents that agree."""
        low, high = bounds(old)
        return np.rint(self.full(old) / (AGREEMENT * (high - low).max() or 1.0)).tobytes()


class Patch:
    """The changes to one asset.

    Attributes:
        edits: JSON values to set, as `jsontext.splice` takes them.
        draft: the buffers' new content.
    """

    def __init__(self, document: Document, buffers: Buffers, geometry: Geometry) -> None:
        self.edits: dict[Path, Any] = {}
        self.draft = Draft(buffers)
        self._document = document
        self._buffers = buffers
        self._geometry = geometry
        self._additions = Additions(document, self.draft)
        # What each accessor holds from now on, of those that share bytes with another.
        self._expected: dict[int, Stored] = {}
        self._shared = sharing_bytes(geometry.accessors.values())

    def apply(self, change: Moves) -> None:
        """Write what moved."""
        sharing: dict[int, list[Use]] = defaultdict(list)
        for use in self._geometry.uses:
            sharing[use.accessor].append(use)
        pinned = pinned_accessors(self._document)
        self._occupied = Occupied(self._document, self._buffers, pinned - sharing.keys())
        repointing = Repointing(self._document, self._geometry.uses)
        for index, uses in sharing.items():
            deadline.check()
            accessor = self._geometry.accessors[index]
            old = accessor.decode(accessor.stored(self._buffers))
            contents = self._contents(old, uses, change)
            if index in pinned and not contents[0].stays:
                contents.insert(0, Content(slice(0), np.empty((0, 3)), []))
            self._keep(accessor, old, contents[0])
            for content in contents[1:]:
                entry = self._own_storage(accessor, content.full(old))
                repointing.assign(content.uses, self._additions.add("accessors", entry))
        self._settle_overlaps()
        self.edits |= repointing.edits(lambda mesh: self._additions.add("meshes", mesh))
        self.edits |= self._additions.edits()

    def _contents(self, old: Values, uses: list[Use], change: Moves) -> list[Content]:
        """The different contents that an accessor's uses ask for, the unchanged one first."""
        groups: dict[tuple[str, int], list[Use]] = defaultdict(list)
        for use in uses:
            groups[use.attribute, use.block].append(use)
        contents: list[Content] = []
        known: dict[bytes, Content] = {}
        for (attribute, block), members in groups.items():
            content = self._content(old, attribute, block, change)
            # All agreeing with the first is the usual case; the others are found by their grid
            # cells, where a value on an edge may cost a copy too many but never a search.
            if contents and content.agrees(contents[0], old):
                contents[0].uses += members
            elif len(groups) == 1:
                contents.append(replace(content, uses=members))
            else:
                cells = content.cells(old)
                if cells in known:
                    known[cells].uses += members
                else:
                    known[cells] = replace(content, uses=members)
                    contents.append(known[cells])
        return sorted(contents, key=lambda content: not content.stays)

    def _content(self, old: Values, attribute: str, number: int, change: Moves) -> Content:
        block, morph = self._geometry.blocks[number], self._geometry.blocks[number].morph
        part = slice(block.start, block.start + block.count)
        mask = (change.moved if attribute == POSITION else change.turned)[part]
        rows: Rows = slice(None) if mask.all() else np.flatnonzero(mask)
        placement, local = block.placement.at(rows), picked(old, rows)[:, :3]
        if attribute == POSITION:
            before, after = self._geometry.vertices[part], change.vertices[part]
            shown = local if morph is None else local + picked(morph, rows)
            values = placement.shifted(shown, picked(before, rows), picked(after, rows))
            if morph is not None:
                values = values - picked(morph, rows)
        elif attribute == NORMAL:
            values = placement.turn_normals(local, picked(change.linear[part], rows))
        else:
            values = placement.turn_tangents(local, picked(change.linear[part], rows))
        return Content(rows, values, [])

    def _keep(self, accessor: Accessor, old: Values, content: Content) -> None:
        """Let `accessor` hold `content`, in place if that can be."""
        if content.stays:
            if accessor.index in self._shared:
                self._expected[accessor.index] = accessor.stored(self._buffers)
            return
        values = content.values
        if accessor.width > values.shape[1]:
            values = np.column_stack([values, old[content.rows, values.shape[1] :]])
        stored = accessor.encode(values)
        target, rows = self._target(accessor, content.rows)
        if stored is None or target is None:
            self._relocate(accessor, content.full(old))
            return
        target[rows] = stored
        after = accessor.stored(self.draft)
        if accessor.index in self._shared:
            self._expected[accessor.index] = after.copy()
        if "min" not in accessor.entry and "max" not in accessor.entry:
            return
        for name, bound in zip(("min", "max"), bounds(after), strict=True):
            said = accessor.entry.get(name)
            # Of normals that are not numbers there are no bounds.
            if said is not None and np.isfinite(bound).all() and not same_bound(said, bound):
                self.edits["accessors", accessor.index, name] = bound.tolist()

    def _target(self, accessor: Accessor, rows: Rows) -> tuple[Stored | None, Rows]:
        """Where elements `rows` are stored, and as which rows there; None if not all are."""
        if accessor.sparse is not None:
            places, span = accessor.sparse
            wanted = np.arange(accessor.count)[rows]
            rows = np.minimum(np.searchsorted(places, wanted), len(places) - 1)
            if not len(places) or (places[rows] != wanted).any():
                return None, rows
        elif accessor.span is not None:
            span = accessor.span
        else:
            return None, rows
        if self._occupied.meets(span, element_size(accessor)):
            return None, rows
        content = self.draft.writable(span.buffer)
        return span.array(content, accessor.dtype, accessor.width), rows

    def _relocate(self, accessor: Accessor, values: Values) -> None:
        """Give `accessor` storage of its own, under its old number."""
        for name in ("min", "max"):
            self.edits.pop(("accessors", accessor.index, name), None)
        self.edits["accessors", accessor.index] = self._own_storage(accessor, values)
        self._expected.pop(accessor.index, None)

    def _own_storage(self, accessor: Accessor, values: Values) -> Object:
        """Append `values` to the accessor's buffer; returns the JSON of an accessor of them."""
        stored = accessor.encode(values)
        entry = {k: v for k, v in accessor.entry.items() if k not in ("byteOffset", "sparse")}
        if stored is None:
            stored = values.astype("<f4")
            entry["componentType"] = FLOAT
            entry.pop("normalized", None)
        buffer = accessor.spans[0].buffer if accessor.spans else 0
        entry["bufferView"] = self._additions.elements_view(stored, buffer, VERTEX_DATA)
        for name, bound in zip(("min", "max"), bounds(stored), strict=True):
            if name in entry and np.isfinite(bound).all():
                entry[name] = bound.tolist()
        return entry

    def _settle_overlaps(self) -> None:
        """Part accessors that overwrote each other's bytes."""
        for index, expected in list(self._expected.items()):
            accessor = self._geometry.accessors[index]
            whole = f"<u{accessor.dtype.itemsize}"
            if not np.array_equal(accessor.stored(self.draft).view(whole), expected.view(whole)):
                self._relocate(accessor, accessor.decode(expected))


def picked(array: NDArray[Any], rows: Rows) -> NDArray[Any]:
    """Some rows of an array; a view where they are a slice."""
    return array[rows] if isinstance(rows, slice) else np.take(array, rows, axis=0)
