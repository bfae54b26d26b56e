"""The vertices of an OBJ, parted where the corners of its faces look different."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from service.mesh.looks import Material, Part
from service.mesh.obj import ObjFile
from service.mesh.polygons import Indices, fan

LARGEST_NUMBER = 1 << 62


class Split:
    """Vertices parted where faces show them with another normal, coordinate or material.

    Attributes:
        of: ``[W]`` the file's vertices, by material, in the order of their first use; last those
            that no face uses.  Each once, in their own order, where none is parted.
        corner: ``[W]`` the first corner of a face that each is; -1 without one.
        faces: ``[F, 3]`` of them, by material, else in their order.
    """

    def __init__(self, file: ObjFile, normal: Indices, texture: Indices, material: Indices) -> None:
        """Part the vertices of a file.

        Args:
            file: the OBJ.
            normal, texture: ``[C]`` the normals and coordinates that corners use, -1 without.
            material: ``[F]`` of the triangles, from -1 on.
        """
        triangles = fan(np.arange(len(texture)), file.corners.counts)
        self._materials, self._ends, order = _in_order_of_use(material)
        if order is not None:
            triangles = triangles[order]
        corners = triangles.reshape(-1)
        owner = np.repeat(np.arange(len(self._ends)), 3 * np.diff(self._ends, prepend=0))
        vertex = file.corner_vertices[corners]
        keys = (normal[corners], texture[corners], owner)
        first, claims = representatives(vertex, keys, len(file.vertices))
        unused = np.flatnonzero(claims < 0)
        if len(self._ends) == 1 and np.array_equal(first, claims[vertex]):
            self.of = np.arange(len(file.vertices))
            self.corner = np.where(claims < 0, -1, corners[claims])
            self.faces = vertex.reshape(-1, 3)
            self._stops = np.array([len(self.of)])
            return
        heads = first == np.arange(len(first))
        self.of = np.concatenate([vertex[heads], unused])
        self.corner = np.concatenate([corners[heads], np.full(len(unused), -1)])
        self.faces = (np.cumsum(heads) - 1)[first].reshape(-1, 3)
        self._stops = np.cumsum(np.bincount(owner[heads], minlength=len(self._ends)))
        self._stops[-1] += len(unused)

    def parts(self, materials: list[Material]) -> list[Part]:
        """The parts, each of one of the materials."""
        starts, firsts = np.append(0, self._stops), np.append(0, self._ends)
        return [
            Part(
                materials[number] if number >= 0 else None,
                int(starts[index]),
                int(starts[index + 1]),
                self.faces[firsts[index] : firsts[index + 1]],
            )
            for index, number in enumerate(self._materials.tolist())
        ]


def representatives(
    vertex: Indices, keys: tuple[Indices, ...], count: int
) -> tuple[Indices, Indices]:
    """The first corner that is the same as each corner, and the first of each vertex.

    Args:
        vertex: ``[C]`` vertices of corners.
        keys: ``[C]`` what else must agree.
        count: of vertices.

    Returns:
        ``[C]``, and ``[count]`` with -1 for a vertex that no corner is of.
    """
    every = np.arange(len(vertex))
    claims = np.full(count, -1)
    # Of several values for one place the last stays.
    claims[vertex[::-1]] = every[::-1]
    first = claims[vertex]
    same = np.ones(len(vertex), bool)
    for key in keys:
        same &= key == key[first]
    # Most corners are like their vertex's first; only the others have to be sorted.
    rest = np.flatnonzero(~same)
    if len(rest):
        _, at, group = np.unique(
            joined(count, vertex[rest], [key[rest] for key in keys]),
            return_index=True, return_inverse=True,
        )  # fmt: skip
        first[rest] = rest[at][group]
    return first, claims


def joined(count: int, group: Indices, keys: Sequence[Indices]) -> Indices:
    """``[C]`` numbers that are equal where groups, less than `count`, and keys from -1 on are."""
    for key in keys:
        width = int(key.max()) + 2
        if count * width >= LARGEST_NUMBER:
            found, group = np.unique(group, return_inverse=True)
            count = len(found)
        group, count = group * width + key + 1, count * width
    return group


def _in_order_of_use(material: Indices) -> tuple[Indices, Indices, Indices | None]:
    """The materials in order of first use, where the faces of each end, and the faces' order."""
    present, at = np.unique(material, return_index=True)
    if len(present) == 1:
        return present, np.array([len(material)]), None
    materials = present[np.argsort(at)]
    rank = np.empty(len(present), np.int64)
    rank[np.argsort(at)] = np.arange(len(present))
    ranks = rank[np.searchsorted(present, material)]
    return materials, np.cumsum(np.bincount(ranks)), np.argsort(ranks, kind="stable")
