"""Where pieces of a mesh touch, and whether an edit tears them apart."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.augment.boxtree import BoxTree
from service.augment.pointface import face_distance, nearest_on_faces

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TOUCH = 2e-3
"""Share of the mesh's diagonal within which pieces touch."""
GAP = 1e-2
"""And beyond which two that touched have come apart."""
SITES = 24
"""Points at most that a contact of two pieces is looked at in."""
CLOSELY = 4
"""And those of them, the nearest, whose distance to the whole other piece is found."""


@dataclass(frozen=True)
class Contacts:
    """Points where pieces touch.

    Attributes:
        faces: ``[F, 3]`` of the mesh.
        piece: ``[F]`` which piece each belongs to.
        pairs: ``[k, 2]`` pieces that touch.
        pair: ``[s]`` which of the pairs each site is of, in order.
        vertex: ``[s]`` the vertex that touches,
        face, weights: ``[s]`` and ``[s, 3]``, and the point of a face that it touches.
    """

    faces: Index
    piece: Index
    pairs: Index
    pair: Index
    vertex: Index
    face: Index
    weights: Array

    @classmethod
    def of(cls, vertices: Array, faces: Index, piece: Index) -> Contacts:
        """Those of a mesh.

        Args:
            vertices: ``[n, 3]``.
            faces: ``[F, 3]``.
            piece: ``[F]``.
        """
        reach = TOUCH * float(np.linalg.norm(np.ptp(vertices, axis=0)))
        near = BoxTree(vertices, faces).near(vertices, reach)
        near = near[piece[near[:, 0]] != piece[near[:, 1]]]
        both = np.concatenate([near, near[:, ::-1]])
        vertex = faces[both[:, 0]].ravel()
        face = np.repeat(both[:, 1], 3)
        keep = np.unique(vertex * len(faces) + face)
        vertex, face = np.divmod(keep, len(faces))
        distance, weights = nearest_on_faces(vertices, faces[face], vertices[vertex])
        touching = distance <= reach
        vertex, face, weights = vertex[touching], face[touching], weights[touching]
        home = np.empty(len(vertices), np.int64)
        home[faces.ravel()] = np.repeat(piece, 3)
        ends = np.sort(np.stack([home[vertex], piece[face]], axis=1), axis=1)
        pairs, pair = np.unique(ends, axis=0, return_inverse=True)
        pair = pair.ravel()
        chosen = _thinned(pair)
        return cls(faces, piece, pairs, pair[chosen], vertex[chosen], face[chosen], weights[chosen])

    def opened(self, vertices: Array, joined: Collection[tuple[int, int]] = ()) -> int:
        """How many pairs of pieces that touched are apart once the vertices have moved.

        Args:
            vertices: ``[n, 3]``.
            joined: pieces that run through each other now, which are not.
        """
        if not len(self.pair):
            return 0
        limit = GAP * float(np.linalg.norm(np.ptp(vertices, axis=0)))
        touched = (vertices[self.faces[self.face]] * self.weights[:, :, None]).sum(axis=1)
        distance = np.linalg.norm(vertices[self.vertex] - touched, axis=1)
        least = np.full(len(self.pairs), np.inf)
        np.minimum.at(least, self.pair, distance)
        return sum(
            self._apart(vertices, pair, distance, limit)
            for pair in np.flatnonzero(least > limit).tolist()
            if tuple(self.pairs[pair].tolist()) not in joined
        )

    def _apart(self, vertices: Array, pair: int, distance: Array, limit: float) -> bool:
        """Whether the pieces of a pair are apart, also where others of their points meet now."""
        sites = np.flatnonzero(self.pair == pair)
        sites = sites[np.argsort(distance[sites], kind="stable")[:CLOSELY]]
        for site in sites.tolist():
            touched = self.faces[self.piece == self.piece[self.face[site]]]
            if face_distance(vertices, touched, vertices[self.vertex[site]]) <= limit:
                return False
        return True


def _thinned(pair: Index) -> Index:
    """Indices of at most `SITES` sites of each pair, spread over them, sorted by the pair."""
    order = np.argsort(pair, kind="stable")
    counts = np.bincount(pair[order]) if len(pair) else np.zeros(0, np.int64)
    rank = np.arange(len(pair)) - np.repeat(np.cumsum(counts) - counts, counts)
    size = np.repeat(counts, counts)
    step = np.maximum(-(-size // SITES), 1)
    return order[rank % step == 0]
