"""Which faces of a mesh run through each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.augment.boxtree import BoxTree

Array = NDArray[np.float64]
Index = NDArray[np.int64]

DEEP = 1e-3
"""Share of the mesh's diagonal by which a face's corners must be on both sides of another's plane,
to count: faces that lie flush do not run through each other."""


class Crossings:
    """Looks for faces that cross, in a mesh whose vertices move."""

    def __init__(self, vertices: Array, faces: Index) -> None:
        """
        Args:
            vertices: ``[n, 3]`` without seams: what faces share is one vertex.
            faces: ``[F, 3]``.
        """
        self._faces, self._tree = faces, BoxTree(vertices, faces)

    def pairs(self, vertices: Array, deep: float = DEEP) -> Index:
        """``[m, 2]`` faces that cross with the vertices where they are now, by more than the share
        `deep` of the diagonal; neighbours, which share a vertex, are none."""
        near = self._tree.near(vertices)
        corners = vertices.T.astype(np.float64)[:, self._faces.T]
        least = deep * float(np.linalg.norm(np.ptp(vertices, axis=0)))
        normals, offsets = _planes(corners)
        for one, other in ((0, 1), (1, 0)):
            plane, faces = near[:, one], near[:, other]
            near = near[_straddles(normals, offsets, corners, plane, faces, least)]
        near = near[~_neighbours(self._faces, near)]
        return near[_pierced(corners, *near.T) | _pierced(corners, *near.T[::-1])]


def _planes(corners: Array) -> tuple[Array, Array]:
    """Unit normals ``[3, F]`` and offsets ``[F]`` of faces with ``corners [3, 3, F]``."""
    a, b, c = corners.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a, axis=0)
    normals /= np.maximum(np.linalg.norm(normals, axis=0), np.finfo(float).tiny)
    return normals, (normals * a).sum(axis=0)


def _straddles(
    normals: Array, offsets: Array, corners: Array, plane: Index, other: Index, deep: float
) -> NDArray[np.bool_]:
    """``[m]`` whether faces ``other [m]`` have corners well on both sides of ``plane [m]``."""
    least, most = np.full(len(plane), np.inf), np.full(len(plane), -np.inf)
    x, y, z = (axis[plane] for axis in normals)
    offset = offsets[plane]
    for corner in range(3):
        height = x * corners[0, corner][other]
        height += y * corners[1, corner][other]
        height += z * corners[2, corner][other]
        height -= offset
        np.minimum(least, height, out=least)
        np.maximum(most, height, out=most)
    return (least < -deep) & (most > deep)


def _neighbours(faces: Index, pairs: Index) -> NDArray[np.bool_]:
    """``[m]`` whether the faces of a pair share a vertex."""
    one, other = faces[pairs[:, 0]], faces[pairs[:, 1]]
    return np.asarray((one[:, :, None] == other[:, None, :]).any(axis=(1, 2)))


def _pierced(corners: Array, one: Index, other: Index) -> NDArray[np.bool_]:
    """``[m]`` whether an edge of faces ``one [m]`` runs through faces ``other [m]``."""
    hit = np.zeros(len(one), bool)
    a, b, c = corners[:, :, other].transpose(1, 0, 2)
    for corner in range(3):
        p, q = corners[:, corner, one], corners[:, (corner + 1) % 3, one]
        below, above = _volume(a, b, c, p), _volume(a, b, c, q)
        sides = np.stack([_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)])
        inside = (sides >= 0.0).all(axis=0) | (sides <= 0.0).all(axis=0)
        hit |= (below * above < 0.0) & inside
    return hit


def _volume(a: Array, b: Array, c: Array, d: Array) -> Array:
    """``[m]`` six times the signed volumes of tetrahedra with corners ``[3, m]``."""
    volume: Array = (np.cross(b - a, c - a, axis=0) * (d - a)).sum(axis=0)
    return volume
