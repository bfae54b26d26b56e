"""What an OBJ looks like: the corners of its faces as vertices, and its materials."""

from __future__ import annotations

import numpy as np

from service import deadline
from service.errors import ShapeError
from service.mesh import limits
from service.mesh.colours import as_light
from service.mesh.corners import TEXTURE
from service.mesh.folder import Folder
from service.mesh.looks import Looks, Material, Statements, Values, flipped
from service.mesh.moves import unit
from service.mesh.mtl import read_materials, text_of
from service.mesh.obj import ObjFile
from service.mesh.polygons import Indices, fan
from service.mesh.split import Split, representatives
from service.mesh.textlines import TextLines

MATERIALS = 256
"""Each is a primitive with targets of its own: with more of them, the mesh comes without."""
SWITCHES = 200_000
"""Lines that choose a material; with more of them, the mesh comes without."""
LIBRARIES = 16
LARGEST_LIBRARY = 8 << 20
ALIKE = 0.999
"""Cosine of the angle up to which a normal is a face's own."""
BLOCK = 4096
"""Faces looked at together: the first few nearly always tell."""

Known = dict[str, Statements]


def obj_looks(file: ObjFile, folder: Folder | None) -> Looks | None:
    """The looks of an OBJ; None where it has none, or comes to more vertices than there may be.

    Args:
        file: the OBJ.
        folder: where its materials are, if they came with it.
    """
    coordinates, texture = _coordinates(file)
    colours = _colours(file)
    names, material = _materials(file, folder)
    normal = file.corner_normals
    if flat(file):
        normal = np.full(len(normal), -1)
    shaded = normal.max(initial=-1) >= 0
    if coordinates is None and colours is None and not shaded and not names:
        return None
    deadline.check()
    split = Split(file, normal, texture, material)
    if len(split.of) > limits.most_vertices():
        return None
    deadline.check()
    return Looks(
        split.of,
        split.parts(names),
        normals=_picked(file.normals, normal, split.corner) if shaded else None,
        coordinates=_picked(coordinates, texture, split.corner),
        colours=None if colours is None else colours[split.of],
    )


def flat(file: ObjFile) -> bool:
    """Whether all normals are those of the faces, and part vertices.

    It is what glTF shows without any; with them, each face would have vertices of its own.
    """
    vertex, normal = file.corner_vertices, file.corner_normals
    if normal.min(initial=0) < 0 or not len(file.normals):
        return False
    _, claims = representatives(vertex, (), len(file.vertices))
    if np.array_equal(normal, normal[claims[vertex]]):
        return False
    triangles = fan(np.arange(len(normal)), file.corners.counts)
    for start in range(0, len(triangles), BLOCK):
        corners = triangles[start : start + BLOCK]
        a, b, c = (file.vertices[vertex[corners[:, i]]] for i in range(3))
        across = np.cross(b - a, c - a)
        known = np.linalg.norm(across, axis=1) > 0.0
        own = unit(across[known], across[known])
        given = file.normals[normal[corners[known]]]
        cosines = np.einsum("ij,ij->i", own, unit(given[:, 0], own))
        # A smooth surface of small faces has normals that are nearly theirs, but not one a face.
        if (given != given[:, :1]).any() or not (cosines > ALIKE).all():
            return False
    return True


def _picked(values: Values | None, indices: Indices, corner: Indices) -> Values | None:
    """``[W, C]`` what corners say of vertices by indices into values; NaN where nothing."""
    if values is None or not len(values):
        return None
    chosen = np.where(corner >= 0, indices[corner], -1)
    found = values[chosen]
    found[chosen < 0] = np.nan
    return found


def _coordinates(file: ObjFile) -> tuple[Values | None, Indices]:
    """``[T, 2]`` texture coordinates, and ``[C]`` which of them each corner uses, or -1."""
    none = np.full(len(file.corner_vertices), -1)
    rows, at = file.lines.beginning(b"vt")
    if not len(rows):
        return None, none
    try:
        used = file.corners.indices(TEXTURE, rows)
        tokens = file.lines.tokens(rows, at)
        numbers = tokens.numbers()
    except ShapeError:
        return None, none
    used[used >= len(rows)] = -1
    if not len(numbers) or tokens.counts.min() < 1 or used.max(initial=-1) < 0:
        return None, none
    second = np.minimum(tokens.first + 1, len(numbers) - 1)
    values = np.stack(
        [numbers[tokens.first], np.where(tokens.counts > 1, numbers[second], 0.0)], axis=1
    )
    return flipped(values), used


def _colours(file: ObjFile) -> Values | None:
    """``[V, 3]`` colours that stand behind the coordinates of all vertices."""
    lines, rows = file.lines, file.vertex_lines
    at = lines.starts[rows] + 1
    if len(lines.bytes[at[0] : lines.ends[rows[0]]].tobytes().split()) < 6:
        return None
    tokens = lines.tokens(rows, at)
    if tokens.counts.min() < 6:
        return None
    return as_light(tokens.numbers()[tokens.first[:, None] + np.arange(3, 6)])


def _materials(file: ObjFile, folder: Folder | None) -> tuple[list[Material], Indices]:
    """The materials that there are, and ``[F]`` which of them each triangle is of, or -1."""
    triangles = np.maximum(file.corners.counts - 2, 0)
    none = np.full(int(triangles.sum()), -1)
    known = {} if folder is None else _libraries(file.lines, folder)
    if not known:
        return [], none
    rows, chosen = said(file.lines, b"usemtl", SWITCHES + 1)
    if len(rows) > SWITCHES:
        return [], none
    names = [name for name in dict.fromkeys(chosen) if name in known]
    numbers = {name: number for number, name in enumerate(names)}
    # Faces ahead of the first choice are of none.
    choices = np.array([-1, *(numbers.get(name, -1) for name in chosen)])
    found = np.repeat(choices[np.searchsorted(rows, file.corners.lines)], triangles)
    used = np.unique(found)
    if len(used) > MATERIALS or used[-1] < 0:
        return [], none
    return [(name, known[name]) for name in names], found


def _libraries(lines: TextLines, folder: Folder) -> Known:
    """The materials of all libraries that the file names and that came with it."""
    known: Known = {}
    for rest in said(lines, b"mtllib", LIBRARIES)[1]:
        # One name with blanks in it, or several.
        whole = folder.find(rest)
        for name in [whole] if whole else map(folder.find, rest.split()[:LIBRARIES]):
            content = folder.content(name, LARGEST_LIBRARY) if name else None
            if content is not None:
                known |= read_materials(content)
    return known


def said(lines: TextLines, keyword: bytes, most: int) -> tuple[Indices, list[str]]:
    """Lines that begin with a keyword, the first few, and what stands behind it.

    They are rare: looking for the word is faster than at each line.
    """
    rows: list[int] = []
    rests: list[str] = []
    at = lines.data.find(keyword)
    while at >= 0 and len(rows) < most:
        line = int(np.searchsorted(lines.starts, at, side="right")) - 1
        end = int(lines.ends[line])
        rest = lines.bytes[at + len(keyword) : end].tobytes()
        if lines.starts[line] == at and rest[:1].isspace():
            rows.append(line)
            rests.append(text_of(rest).strip())
        at = lines.data.find(keyword, end)
    return np.array(rows, np.int64), rests
