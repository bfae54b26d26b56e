"""The left half of a closed body surface, cut out of MakeHuman's base mesh, and its mirroring.

The base mesh is symmetric and closed, but its eye sockets and its mouth are bags that reach into
the head.  They are cut off along their texture seams, and what is open is closed again: each eye by
a fan to the eyeball's foremost vertex, the mouth from lip to lip.  Only the base mesh's own
vertices are used, so that its shape targets and skinning weights are those of the result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.csgraph
from numpy.typing import NDArray

from model_export.body.makehuman import MakeHuman

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Half:
    """The left half of a closed, symmetric mesh, open along the middle only.

    Attributes:
        vertices: ``[h]`` indices into the base mesh.
        faces: ``[F, 3]`` indices into ``vertices``.
        middle: ``[h]`` whether a vertex lies on the plane of symmetry.
    """

    vertices: Indices
    faces: Indices
    middle: NDArray[np.bool_]

    def mirrored(self) -> tuple[Indices, Indices]:
        """The whole mesh.

        Returns:
            ``[2F, 3]`` faces, and ``[V]`` each vertex's mirror image.  Vertices are the half's own,
            then copies of those off the middle, in order.
        """
        count = len(self.vertices)
        sides = np.flatnonzero(~self.middle)
        other = np.arange(count)
        other[sides] = count + np.arange(len(sides))
        faces = np.concatenate([self.faces, other[self.faces][:, ::-1]])
        return faces, np.concatenate([other, sides])


def closed_half(source: MakeHuman, shape: Array) -> Half:
    """The closed half of a body.

    Args:
        source: the base mesh.
        shape: ``[N, 3]`` vertices, by which quads are split along their shorter diagonal.
    """
    left = source.vertices[:, 0] > 0.0
    middle = source.mirror == np.arange(len(source.vertices))
    kept = (left | middle)[source.quads].all(axis=1)
    quads, texture = source.quads[kept], source.texture[kept]
    islands = _components(texture)
    bags = {
        name: islands == _nearest_island(source, quads, islands, name)
        for name in ("helper-l-eye", "helper-upper-teeth")
    }
    faces = [_triangles(quads[~np.any(list(bags.values()), axis=0)], shape)]
    eye = source.groups["helper-l-eye"]
    pole = int(eye[np.argmax(shape[eye, 2])])
    rim = _rim(quads[bags["helper-l-eye"]], middle)
    faces.append(np.array([[a, b, pole] for a, b in rim]))
    faces.append(_zipped(_path(_rim(quads[bags["helper-upper-teeth"]], middle)), shape))
    triangles = np.concatenate(faces)
    vertices, flat = np.unique(triangles, return_inverse=True)
    return Half(vertices, flat.reshape(-1, 3), middle[vertices])


def _components(cells: Indices) -> Indices:
    """``[F]`` label of the connected piece that each cell ``[F, 4]`` is in."""
    count = int(cells.max()) + 1
    pairs = np.concatenate([cells[:, [k, (k + 1) % 4]] for k in range(4)])
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count,) * 2)
    labels = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    return labels[cells[:, 0]]


def _nearest_island(source: MakeHuman, quads: Indices, islands: Indices, helper: str) -> int:
    """The texture island whose middle is nearest to a helper's left half."""
    points = source.vertices[source.groups[helper]]
    target = points[points[:, 0] >= 0.0].mean(axis=0)
    labels = np.unique(islands)
    middles = [source.vertices[np.unique(quads[islands == label])].mean(0) for label in labels]
    return int(labels[np.argmin(np.linalg.norm(np.array(middles) - target, axis=1))])


def _triangles(quads: Indices, shape: Array) -> Indices:
    a, b, c, d = quads.T
    first = np.linalg.norm(shape[a] - shape[c], axis=1)
    second = np.linalg.norm(shape[b] - shape[d], axis=1)
    ac = (first <= second)[:, None]
    halves = [
        np.where(ac, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1)),
        np.where(ac, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1)),
    ]
    return np.concatenate(halves)


def _rim(quads: Indices, middle: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Directed border edges of quads, in their sense, but for those along the middle."""
    edges = {(int(q[k]), int(q[(k + 1) % 4])) for q in quads for k in range(4)}
    rim = sorted((a, b) for a, b in edges if (b, a) not in edges)
    return [(a, b) for a, b in rim if not (middle[a] and middle[b])]


def _path(edges: list[tuple[int, int]]) -> list[int]:
    """Vertices along a chain of directed edges."""
    following = dict(edges)
    (start,) = set(following) - set(following.values())
    path = [start]
    while path[-1] in following:
        path.append(following[path[-1]])
    return path


def _zipped(path: list[int], shape: Array) -> Indices:
    """Triangles that close a path from the middle to the middle, from its outer corner inwards."""
    corner = int(np.argmax(shape[path, 0]))
    back, ahead = path[: corner + 1][::-1], path[corner:]
    i = j = 0
    triangles = []
    while i < len(back) - 1 or j < len(ahead) - 1:
        # The side that lags behind, as a share of its length, goes next.
        if (i + 1) * (len(ahead) - 1) <= (j + 1) * (len(back) - 1):
            triangles.append([back[i + 1], back[i], ahead[j]])
            i += 1
        else:
            triangles.append([back[i], ahead[j], ahead[j + 1]])
            j += 1
    return np.array([face for face in triangles if len(set(face)) == 3])
