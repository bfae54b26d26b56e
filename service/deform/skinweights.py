"""Skinning weights for a mesh from the body that was fitted to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from service.deform.inpaint import fill, laplacian, smooth
from service.deform.normals import face_crosses, vertex_normals
from service.deform.skinhair import HEAD, hair_pieces
from service.deform.skinmatch import AGREE, FAR, BodySurface
from service.deform.skinpieces import carried_pieces, carry, contacts, group_sums, one_limb
from service.deform.weld import Welded
from service.template.anatomy import JOINTS
from service.template.skinned import Body, SkinnedTemplate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Neighbours on the mesh whose matches are so many times as far apart on the resting body, and
# this much more, in metres, aren't both right.
STRETCH = 3.0
JUMP = 0.05
# A patch between such jumps is right when it has this share of its piece's area.
MAIN = 0.2
# So far from what is known, in metres, a match that is far from the body counts as much.
REACH = 0.15
# What is between the legs is smoothed over so many times its distance from them.
SLOW = 2.0
# Steps of smoothing over the whole mesh.
STEPS = 2
# Where edges are longer than this, in metres, smoothing fades out.
FINE = 0.02


def skin_values(mesh: Welded, template: SkinnedTemplate, body: Body) -> Array:
    """``[n, 24 + 3 S]`` skinning weights and shape directions of a mesh's positions.

    Matches with the body that are far, turned away or at odds with the neighbours' are replaced by
    a smooth continuation of the others along the mesh.

    Args:
        mesh: the upload, welded, in the frame and unit of ``body``.
        template: what was fitted.
        body: the fit.
    """
    x = (mesh.vertices - body.translation) / body.scale
    piece = mesh.piece
    surface = BodySurface.of(template, body)
    normals = surface.outward(x, vertex_normals(x, mesh.faces))
    match = one_limb(x, normals, piece, surface.match(x, normals), surface)
    area = vertex_areas(x, mesh.faces)
    sound = surface.sound(x, match)
    sound &= consistent(x, mesh, match.rest, sound, area)
    hair = hair_pieces(x, area, piece, match, template, surface.points)[piece]
    sound &= ~hair | (match.values[:, HEAD] > 0.5)
    carried = carried_pieces(x, area, piece)
    touching, values = contacts(x, piece, carried, sound, match.values)
    # Skirts pass over from leg to leg as slowly as they are far from them.
    between = surface.between_legs(x, match) & ~hair
    known = sound & ~between | touching
    # Where nothing is known of a piece, of carried ones, and without a face, all is as it is.
    blank = np.bincount(piece, known, minlength=mesh.pieces) == 0
    matrix = laplacian(x, mesh.faces)
    known |= blank[piece] | carried[piece] | (matrix.diagonal() == 0.0)
    # A large head is all head, however far it is from the fitted one.
    far = (match.distance >= FAR) & (match.agreement > AGREE) & ~hair
    reach = np.where(far, REACH, np.inf)
    reach[between] = SLOW * match.distance[between]
    values = fill(matrix, known, values, area / reach**2)
    # The faces around a vertex cover a few times the square of their sides.
    strength = 0.5 * np.minimum(1.0, FINE**2 / np.maximum(area, 1e-12))
    values = smooth(matrix, values, strength, STEPS)
    values[hair, : len(JOINTS)] = np.eye(len(JOINTS))[HEAD]
    return carry(x, piece, carried, sound, values)


def consistent(x: Array, mesh: Welded, rest: Array, sound: Mask, area: Array) -> Mask:
    """``[n]`` whose matches go with those of their neighbours on the mesh.

    A palm on a hip may be matched with the hip; but then its edges, short on the mesh, lead from
    hip to wrist on the body at rest.  Where such edges cut a patch out of a piece that is small in
    it, the patch is wrong.

    Args:
        x: ``[n, 3]`` in metres.
        mesh: that they are the positions of.
        rest: ``[n, 3]`` the matches on the resting body.
        sound: ``[n]`` whose matches count.
        area: ``[n]`` of the surface around each.
    """
    # Two sides of each face connect what three do.
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]]])
    gap = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    direct = sound[edges].all(axis=1)
    far_ends, far_gap = _across(edges[~direct], gap[~direct], sound)
    ends, gap = np.concatenate([edges[direct], far_ends]), np.concatenate([gap[direct], far_gap])
    a, b = ends[
        np.linalg.norm(rest[ends[:, 0]] - rest[ends[:, 1]], axis=1) < STRETCH * gap + JUMP
    ].T
    links = csr_array((np.ones(len(a), np.int8), (a, b)), shape=(len(x), len(x)))
    count, patch = connected_components(links, directed=False)
    of_patch = np.bincount(patch, np.where(sound, area, 0.0), minlength=count)
    largest = np.zeros(mesh.pieces)
    np.maximum.at(largest, mesh.piece, of_patch[patch])
    return of_patch[patch] >= MAIN * largest[mesh.piece]


def _across(edges: Index, length: Array, sound: Mask) -> tuple[Index, Array]:
    """Pairs ``[p, 2]`` of sound positions that face each other across others, and the ways ``[p]``
    between them along the edges."""
    nodes, ends = np.unique(edges, return_inverse=True)
    # Once each: lengths of the same entry would add up.
    low, high = np.sort(ends.reshape(-1, 2), axis=1).T
    first = np.unique(low * len(nodes) + high, return_index=True)[1]
    ends, length = np.stack([low[first], high[first]], axis=1), length[first]
    sources = np.flatnonzero(sound[nodes])
    if not len(sources):
        return np.empty((0, 2), np.int64), np.empty(0)
    graph = csr_array((np.maximum(length, 1e-9), ends.T), shape=(len(nodes), len(nodes)))
    way, _, source = dijkstra(
        graph, directed=False, indices=sources, return_predecessors=True, min_only=True
    )
    reached = np.isfinite(way[ends]).all(axis=1)
    ends = ends[reached]
    pairs: Index = nodes[source[ends]]
    return pairs, way[ends].sum(axis=1) + length[reached]


def vertex_areas(x: Array, faces: Index) -> Array:
    """``[n]`` a third of the area of the faces around each vertex."""
    area = np.linalg.norm(face_crosses(x, faces), axis=1) / 6.0
    return group_sums(faces.ravel(), np.repeat(area, 3), len(x))
