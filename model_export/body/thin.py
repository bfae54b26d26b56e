"""Thinning a symmetric mesh: edges of one half collapse onto one of their own ends.

Quadric error metrics (Garland and Heckbert, Surface Simplification Using Quadric Error Metrics,
1997).  As vertices are dropped and none is moved, all that is known of a vertex (shape targets,
skinning weights) stays what it was.
"""

from __future__ import annotations

import heapq

import numpy as np
from numpy.typing import NDArray

from model_export.body.closed import Half

Array = NDArray[np.float64]

FLATNESS = 0.2
"""Least cosine between a face's normals before and after a collapse."""
EVENNESS = 1.5e-3
"""Weight of the edges' lengths, without which hands and ears would keep most of the vertices."""

_Collapse = tuple[float, int, int, int, int]
"""Cost, the vertex to drop and the one to keep, and how often their surroundings had changed."""


def thinned(half: Half, points: Array, count: int) -> Half:
    """The half with ``count`` vertices, or as few as it goes.

    Args:
        half: to be thinned.
        points: ``[h, 3]`` of its vertices.
        count: of vertices to keep.
    """
    thinner = _Thinner(half, points)
    alive = thinner.collapse(count)
    faces = np.array([face for face in thinner.faces if face is not None])
    position = np.full(len(points), -1)
    position[alive] = np.arange(len(alive))
    return Half(half.vertices[alive], position[faces], half.middle[alive])


class _Thinner:
    """A mesh in the course of thinning."""

    def __init__(self, half: Half, points: Array) -> None:
        self.points, self.middle = points, half.middle
        self.faces: list[tuple[int, int, int] | None] = [
            (int(a), int(b), int(c)) for a, b, c in half.faces
        ]
        self.around: list[set[int]] = [set() for _ in points]
        for index, face in enumerate(half.faces):
            for vertex in face:
                self.around[vertex].add(index)
        self.quadrics = _quadrics(points, half.faces)
        self.changes = [0] * len(points)

    def collapse(self, count: int) -> NDArray[np.int64]:
        """Collapse the cheapest edges; gives the vertices that stay, ascending."""
        heap: list[_Collapse] = []
        for v in range(len(self.points)):
            self._queue(heap, v)
        alive = np.ones(len(self.points), dtype=bool)
        left = len(self.points)
        while left > count and heap:
            _, v, u, *changes = heapq.heappop(heap)
            fresh = alive[v] and alive[u] and changes == [self.changes[v], self.changes[u]]
            if not fresh or not self._allowed(v, u):
                continue
            self._merge(v, u)
            alive[v] = False
            left -= 1
            touched = sorted(self._neighbours(u) | {u})
            for vertex in touched:
                self.changes[vertex] += 1
            for vertex in touched:
                self._queue(heap, vertex)
        return np.flatnonzero(alive)

    def _queue(self, heap: list[_Collapse], vertex: int) -> None:
        """Put the edges at a vertex on the heap, to collapse either way."""
        for other in sorted(self._neighbours(vertex)):
            for v, u in ((vertex, other), (other, vertex)):
                heapq.heappush(heap, (self._cost(v, u), v, u, self.changes[v], self.changes[u]))

    def _neighbours(self, vertex: int) -> set[int]:
        return {w for f in self.around[vertex] for w in self._face(f)} - {vertex}

    def _face(self, index: int) -> tuple[int, int, int]:
        face = self.faces[index]
        assert face is not None
        return face

    def _cost(self, v: int, u: int) -> float:
        """Squared distance times area that dropping ``v`` for ``u`` costs."""
        point = np.append(self.points[u], 1.0)
        length = self.points[v] - self.points[u]
        square = float(length @ length)
        return float(point @ self.quadrics[v] @ point) + EVENNESS * square * square

    def _allowed(self, v: int, u: int) -> bool:
        """Whether the mesh stays a surface that is open along the middle only, and unfolded."""
        if self.middle[v] and not self.middle[u]:
            return False
        shared = self.around[v] & self.around[u]
        along = bool(self.middle[v])
        if len(shared) != (1 if along else 2):
            return False
        opposite = {w for f in shared for w in self._face(f)} - {v, u}
        beyond = self._neighbours(v)
        if beyond & self._neighbours(u) != opposite or len(beyond) <= 3 - along:
            return False
        # An inner edge between two vertices of the middle would be the mirrored half's too.
        joined = beyond - opposite - {u}
        if self.middle[u] and not along and any(self.middle[w] for w in joined):
            return False
        return all(self._kept_upright(f, v, u) for f in self.around[v] - shared)

    def _kept_upright(self, index: int, v: int, u: int) -> bool:
        corners = self._face(index)
        before = _normal(*(self.points[w] for w in corners))
        after = _normal(*(self.points[u if w == v else w] for w in corners))
        lengths = float(np.sqrt((before @ before) * (after @ after)))
        return lengths > 0.0 and float(before @ after) > FLATNESS * lengths

    def _merge(self, v: int, u: int) -> None:
        for index in self.around[v]:
            a, b, c = self._face(index)
            if u in (a, b, c):
                for w in {a, b, c} - {v}:
                    self.around[w].discard(index)
                self.faces[index] = None
            else:
                x, y, z = (u if w == v else w for w in (a, b, c))
                self.faces[index] = (x, y, z)
                self.around[u].add(index)
        self.around[v] = set()
        self.quadrics[u] += self.quadrics[v]


def _quadrics(points: Array, faces: NDArray[np.int64]) -> Array:
    """``[h, 4, 4]`` sum of each vertex's squared distances from its faces' planes, by area."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(areas, 1e-30)[:, None]
    planes = np.column_stack([normals, -(normals * corners[:, 0]).sum(axis=1)])
    products = (areas / 6)[:, None, None] * planes[:, :, None] * planes[:, None, :]
    quadrics = np.zeros((len(points), 4, 4))
    for corner in range(3):
        np.add.at(quadrics, faces[:, corner], products)
    return quadrics


def _normal(a: Array, b: Array, c: Array) -> Array:
    (ux, uy, uz), (vx, vy, vz) = b - a, c - a
    return np.array([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])
