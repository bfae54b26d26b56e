"""Hair, hats and the like: pieces of a mesh that turn with the head, wherever they hang."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.deform.skinmatch import Match
from service.deform.skinpieces import SHARDS, SMALL, TOUCH, group_sums, piece_sizes
from service.template.anatomy import JOINTS
from service.template.skinned import SkinnedTemplate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

HEAD, NECK = JOINTS.index("head"), JOINTS.index("neck")
# Hair has at least this share of its area by the head.
ON_HEAD = 0.2
# It touches less than this of the face.
FACE = 0.3
# It has less than this share of its area on the skin below the neck, and is no longer than this,
# in metres.
ON_SKIN, LONG = 0.2, 1.0
# A strand, which lies on hair, has this share by the head or neck; and with none of it by the head
# this share of it on hair.
STRAND, LIES = 0.15, 0.6
# Shares that are more than none.
SOME = 0.05
# So often strands hand on what they are.
ROUNDS = 4


def hair_pieces(
    x: Array, area: Array, piece: Index, match: Match, template: SkinnedTemplate, surface: Array
) -> Mask:
    """``[pieces]`` which are over the head, but not the face, and strands that lie on those.

    Hair lies on shoulders and back, which it is matched with, but turns with the head.

    Args:
        x: ``[n, 3]`` in metres.
        area: ``[n]`` of the surface around each.
        piece: ``[n]``.
        match: of ``x``.
        template: what was fitted.
        surface: ``[p, 3]``, of which the first are its posed vertices, in the frame of ``x``.
    """
    count = int(piece.max()) + 1
    sizes = piece_sizes(x, piece)
    small = sizes < SMALL
    if area[small[piece]].sum() >= SHARDS * area.sum():
        return np.zeros(count, bool)
    head, neck = match.values[:, HEAD], match.values[:, NECK]
    whole = np.maximum(group_sums(piece, area, count), 1e-30)

    def share(mask: Mask) -> Array:
        return group_sums(piece, np.where(mask, area, 0.0), count) / whole

    on_head = share(head > 0.5)
    on_skin = share((head + neck < 0.3) & (match.distance < TOUCH))
    hair = (on_head > ON_HEAD) & (on_skin < ON_SKIN) & (sizes < LONG)
    strands = (share(head + neck > 0.5) > STRAND) & (sizes < LONG) | small
    strands &= on_skin < 2.0 * ON_SKIN
    rows = np.flatnonzero((hair | strands)[piece])
    bare = covered(x[rows], piece[rows], count, surface[face_vertices(template)]) < FACE
    return _with_strands(x, piece, hair & bare, strands & bare, on_head > SOME)


def _with_strands(x: Array, piece: Index, hair: Mask, strands: Mask, top: Mask) -> Mask:
    """``[pieces]`` hair, and the strands that touch it if they start at the top, else lie on it."""
    count = np.maximum(np.bincount(piece, minlength=len(hair)), 1)
    for _ in range(ROUNDS):
        rows = np.flatnonzero((strands & ~hair)[piece])
        if not len(rows) or not hair.any():
            break
        distance = cKDTree(x[hair[piece]]).query(x[rows], distance_upper_bound=TOUCH)[0]
        meets = group_sums(piece[rows], np.isfinite(distance), len(hair)) / count
        hair = hair | (meets > np.where(top, SOME, LIES))
    return hair


def covered(x: Array, piece: Index, count: int, points: Array) -> Array:
    """``[count]`` the share of ``points [p, 3]`` that each piece touches."""
    if not len(x):
        return np.zeros(count)
    near = cKDTree(x).sparse_distance_matrix(cKDTree(points), TOUCH, output_type="ndarray")
    pairs = np.unique(piece[near["i"]] * len(points) + near["j"])
    share: Array = np.bincount(pairs // len(points), minlength=count) / len(points)
    return share


def face_vertices(template: SkinnedTemplate) -> Index:
    """Template vertices of the lower half of the face."""
    rest, head = template.rest, template.weights[:, HEAD] > 0.7
    front = head & (rest[:, 2] > np.quantile(rest[head, 2], 0.7))
    return np.flatnonzero(front & (rest[:, 1] < np.median(rest[front, 1])))
