"""OFF and its variants with colours (COFF), normals (NOFF) and texture coordinates (STOFF).

Only coordinates, and in NOFF the normals behind them, change.
"""

from __future__ import annotations

import re

import numpy as np

from service.mesh import moves
from service.mesh.faults import malformed, quoted, unsupported
from service.mesh.meshfile import Faces, Linear, MeshFile, Vertices
from service.mesh.polygons import Indices, as_indices, fan
from service.mesh.replacement import Replacement, rewrite
from service.mesh.textlines import TextLines, Tokens

KEYWORD = re.compile(rb"(ST)?(C)?(N)?(4)?(n)?OFF")
COUNT = re.compile(rb"[0-9]{1,12}")


class OffFile(MeshFile):
    """An OFF file.

    Attributes:
        letters: what its keyword says that vertices have: "ST", "C" and "N" in a row.
        width: numbers that every vertex has.
    """

    format = "off"
    media_type = "model/vnd.off"

    def __init__(self, data: bytes) -> None:
        """Read `data`; InvalidMesh or UnsupportedFormat when that can't be."""
        self.data = data
        lines = TextLines("off", data)
        filled = lines.filled()
        self.letters, counts, used = _header(lines, filled)
        vertex_lines = filled[used : used + counts[0]]
        face_lines = filled[used + counts[0] : used + sum(counts)]
        if len(vertex_lines) + len(face_lines) < sum(counts):
            raise malformed("off", f"it ends before its {counts[0]} vertices and {counts[1]} faces")
        self._tokens = lines.tokens(vertex_lines)
        self._has_normals = "N" in self.letters
        width = 6 if self._has_normals else 3
        self.width = int(self._tokens.counts.min()) if counts[0] else width
        if self.width < width:
            line = vertex_lines[int(np.argmin(self._tokens.counts))] + 1
            raise malformed("off", f"line {line} has fewer than {width} numbers")
        self._values = self._tokens.numbers()
        self.vertices = self.columns(0, 3)
        self.faces = _faces(lines.tokens(face_lines))

    def columns(self, start: int, count: int) -> Vertices:
        """``[V, count]`` numbers of the vertices, some of their `width`."""
        return self._values[self._columns(start, count)]

    def _columns(self, start: int, count: int = 3) -> Indices:
        """``[V, count]`` token numbers of some columns."""
        return self._tokens.first[:, None] + np.arange(start, start + count)

    @moves.tolerant
    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        """See `MeshFile.write`."""
        change = moves.compare(self.vertices, vertices, linear)
        if not change.any:
            return self.data
        rows = np.flatnonzero(change.moved)
        replacements = [self._replace(self._columns(0)[rows], vertices[rows])]
        if self._has_normals:
            rows = np.flatnonzero(change.turned)
            columns = self._columns(3)[rows]
            turned = moves.turn_normals(self._values[columns], linear[rows])
            replacements.append(self._replace(columns, turned))
        return rewrite(self.data, replacements)

    def _replace(self, tokens: Indices, values: Vertices) -> Replacement:
        flat = tokens.reshape(-1)
        starts, ends = self._tokens.spans(flat)
        return Replacement(starts, ends, self._values[flat], values.reshape(-1))


def _header(lines: TextLines, filled: Indices) -> tuple[str, tuple[int, int], int]:
    """The letters of what vertices have; the counts of vertices and faces; lines used for that."""
    words: list[bytes] = []
    used = 0
    letters = ""
    for line in filled[:2].tolist():
        text = lines.data[lines.starts[line] : lines.ends[line]].partition(b"#")[0]
        used += 1
        keyword = KEYWORD.match(text) if used == 1 else None
        if keyword:
            if keyword[4] or keyword[5] or b"BINARY" in text:
                raise unsupported(
                    "off_variant",
                    f"The file is of the OFF variant {quoted(text.decode('latin-1').strip())}",
                    "Export it as OFF in ASCII with three coordinates",
                )
            letters = b"".join(part for part in keyword.groups() if part).decode()
            # Some writers put the counts right behind the keyword, even without a blank.
            text = text[keyword.end() :]
        words += text.split()
        if words:
            break
    if len(words) < 2 or not all(COUNT.fullmatch(word) for word in words[:2]):
        raise malformed("off", "it does not begin with OFF and the numbers of vertices and faces")
    return letters, (int(words[0]), int(words[1])), used


def _faces(tokens: Tokens) -> Faces:
    values = as_indices(tokens.numbers())
    if not len(tokens.counts):
        return np.empty((0, 3), np.int64)
    sizes = values[tokens.first]
    if (sizes < 0).any() or (sizes >= tokens.counts).any():
        raise malformed("off", "a face has fewer corners than it says")
    step = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return fan(values[np.repeat(tokens.first + 1, sizes) + step], sizes)
