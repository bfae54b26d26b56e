"""The three numbers behind a keyword: positions and normals of the text formats."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.mesh.faults import malformed
from service.mesh.meshfile import Vertices
from service.mesh.replacement import Replacement
from service.mesh.textlines import TextLines, Tokens

XYZ = np.arange(3)


class Triples:
    """Three neighbouring numbers of each of some lines.

    Attributes:
        lines: ``[N]`` line numbers, from 0.
        values: ``[N, 3]``.
    """

    def __init__(self, lines: TextLines, *keywords: bytes) -> None:
        """The first three numbers of every line that begins with `keywords`."""
        self.lines, at = lines.beginning(*keywords)
        self._tokens: Tokens = lines.tokens(self.lines, at)
        if len(self.lines) and self._tokens.counts.min() < 3:
            line = self.lines[int(np.argmin(self._tokens.counts))] + 1
            raise malformed(lines.format, f"line {line} has fewer than 3 numbers")
        values = self._tokens.numbers()
        self.values: Vertices = values[self._tokens.first[:, None] + XYZ]

    def changed(self, rows: NDArray[np.bool_], values: Vertices) -> Replacement:
        """The tokens of the lines chosen by `rows` ``[N]``, to become `values` ``[N, 3]``."""
        tokens = self._tokens.first[rows, None] + XYZ
        starts, ends = self._tokens.spans(tokens.reshape(-1))
        return Replacement(starts, ends, self.values[rows].reshape(-1), values[rows].reshape(-1))
