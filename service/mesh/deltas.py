"""How the displacements of morph targets are stored: sparse or dense, as floats or fractions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.mesh.additions import VERTEX_DATA, Additions, box
from service.mesh.document import Document
from service.mesh.jsontext import Path
from service.mesh.moves import any_of_rows

Values = NDArray[np.floating]

QUANTIZATION = "KHR_mesh_quantization"
COARSE = 2e-5
"""Largest error of a quantised displacement, as a share of the size of what it displaces."""
TURN = 0.004
"""The same for normals and tangents, whose size is one: what an eighth of a byte's range is."""


class Deltas:
    """Stores displacements in the least room.

    Attributes:
        additions: to the asset.
    """

    def __init__(self, additions: Additions, quantize: bool) -> None:
        """With `quantize`, as fractions of one, where those are fine enough and none is more."""
        self.additions = additions
        self._quantize = quantize
        self._quantized = False

    def positions(self, values: Values, size: float) -> int:
        """An accessor of ``[count, 3]`` displacements of something of a size."""
        elements, members = self._elements(values, "<i2", COARSE * size)
        return self._store(elements, members | box(elements))

    def directions(self, values: Values) -> int:
        """An accessor of ``[count, 3]`` changes of normals or tangents."""
        return self._store(*self._elements(values, "<i1", TURN))

    def extensions(self, document: Document) -> dict[Path, Any]:
        """The JSON that tells of quantised displacements, where there are any."""
        if not self._quantized:
            return {}
        edits: dict[Path, Any] = {}
        for member in ("extensionsUsed", "extensionsRequired"):
            had = document.array(document.root, member)
            if QUANTIZATION not in had:
                edits[(member,)] = [*had, QUANTIZATION]
        return edits

    def _store(self, elements: NDArray[Any], members: dict[str, Any]) -> int:
        rows = np.flatnonzero(any_of_rows(elements != 0))
        count, size = len(elements), 3 * elements.itemsize
        if not len(rows):
            return self.additions.zeros(elements, count, **members)
        index = 2 if count <= 1 << 16 else 4
        if len(rows) * (size + index) < count * (size + -size % 4):
            return self.additions.sparse(rows, elements[rows], count, **members)
        return self.additions.accessor(elements, VERTEX_DATA, **members)

    def _elements(
        self, values: Values, kind: str, error: float
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        finest = float(np.iinfo(kind).max)
        if self._quantize and 0.5 / finest <= error and values.size and np.abs(values).max() <= 1.0:
            self._quantized = True
            return np.rint(values * finest).astype(kind), {"normalized": True}
        return values.astype("<f4"), {}
