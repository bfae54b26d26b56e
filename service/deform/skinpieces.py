"""Pieces of a mesh that the body itself says little of: buttons, eyes, fingers, bags."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from service.deform.skinmatch import FAR, LIMBS, BodySurface, Match, limbs_of
from service.template.anatomy import JOINTS

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Pieces smaller than this, in metres, are carried.
SMALL = 0.12
# A mesh that has this share of its area in such pieces is in shards.
SHARDS = 0.5
# The size of a hand, and the share of a piece that one limb must have for its match to be sure.
HAND, SURE = 0.3, 0.95
# The share that one limb must have of pieces that touch to have them all.
CLEAR = 0.6
# What is this near, in metres, of so many neighbours, is in contact.
CONTACT, NEIGHBOURS = 0.003, 6
# Sums of differences of weights below this are of one limb.
ALIKE = 0.8
# Positions of a carried piece that are asked what it sits on.
ENOUGH = 200
# What is this near, in metres, touches.
TOUCH = 0.02


def carried_pieces(x: Array, area: Array, piece: Index) -> Mask:
    """``[pieces]`` which are carried as a whole, as buttons and eyes are.

    Args:
        x: ``[n, 3]`` in metres.
        area: ``[n]`` of the surface around each.
        piece: ``[n]``.
    """
    small = piece_sizes(x, piece) < SMALL
    # A mesh in shards has nothing to carry them.
    return small & (area[small[piece]].sum() < SHARDS * area.sum())


def one_limb(x: Array, normals: Array, piece: Index, match: Match, surface: BodySurface) -> Match:
    """Match pieces no larger than a hand with one limb only, that they lie around as a whole.

    A finger on a hip touches it with one side; its own place on the body has all its sides.

    Args:
        x, normals: ``[n, 3]`` in metres.
        piece: ``[n]``.
        match: of ``x`` with any limb.
        surface: of the body.
    """
    limb = limbs_of(match.values)
    small = piece_sizes(x, piece)[piece] < HAND
    if len(np.unique(limb[small])) < 2:
        return match
    joined = touching_pieces(x, piece)
    # Where two hands touch, what is joined is no one limb.
    clear = _votes(joined, limb).max(axis=1) > CLEAR
    piece = np.where(clear[joined], joined, int(joined.max()) + 1 + piece)
    votes = _votes(piece, limb)
    count = len(votes)
    split = (piece_sizes(x, piece) < HAND) & (votes.max(axis=1) < SURE)
    rows = split[piece]
    if not rows.any():
        return match
    # Only limbs that some of a piece is near.
    cost = np.full((count, votes.shape[1]), np.inf)
    matches = {}
    for index in np.flatnonzero((votes[split] > 0.0).any(axis=0)).tolist():
        own = surface.match(x[rows], normals[rows], surface.limb == index)
        matches[index] = own
        total = np.bincount(piece[rows], own.spread, minlength=count)
        cost[:, index] = total / np.maximum(np.bincount(piece[rows], minlength=count), 1)
    best = cost.argmin(axis=1)[piece[rows]]
    for index, own in matches.items():
        chosen = best == index
        match = match.replaced(np.flatnonzero(rows)[chosen], own.taken(chosen))
    return match


def _votes(piece: Index, limb: Index) -> Array:
    """``[pieces, limbs]`` shares of the limbs in each piece."""
    votes = np.zeros((int(piece.max()) + 1, len(LIMBS) + 1))
    np.add.at(votes, (piece, limb), 1.0)
    return votes / np.maximum(votes.sum(axis=1, keepdims=True), 1.0)


def touching_pieces(x: Array, piece: Index) -> Index:
    """``[n]`` the pieces, with those smaller than a hand that touch, as the links of a finger do,
    made one as long as that is no larger either."""
    small = np.flatnonzero(piece_sizes(x, piece)[piece] < HAND)
    if not len(small):
        return piece
    distance, index = cKDTree(x[small]).query(x[small], k=NEIGHBOURS, distance_upper_bound=CONTACT)
    row, column = np.nonzero(np.isfinite(distance))
    a, b = piece[small[row]], piece[small[index[row, column]]]
    count = int(piece.max()) + 1
    links = csr_array((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    joined = connected_components(links, directed=False)[1][piece]
    return np.where(piece_sizes(x, joined)[joined] < HAND, joined, count + piece)


def contacts(
    x: Array, piece: Index, carried: Mask, sound: Mask, values: Array
) -> tuple[Mask, Array]:
    """What pieces that nothing sound is known of take from where they touch what is known.

    Args:
        x, piece: see `carried_pieces`.
        carried: ``[pieces]`` which need nothing.
        sound: ``[n]`` of which positions the ``values [n, c]`` are known.
        values: of all.

    Returns:
        ``[n]`` which positions touch, and the values with theirs.
    """
    some = np.bincount(piece, sound, minlength=int(piece.max()) + 1) > 0
    blank = np.flatnonzero(~some[piece] & ~carried[piece])
    touching = np.zeros(len(x), bool)
    host = np.flatnonzero(sound & ~carried[piece])
    if not len(blank) or not len(host):
        return touching, values
    distance, nearest = cKDTree(x[host]).query(x[blank])
    least = np.full(len(some), np.inf)
    np.minimum.at(least, piece[blank], distance)
    touches = distance < least[piece[blank]] + TOUCH
    touching[blank[touches]] = True
    values = values.copy()
    values[blank[touches]] = values[host[nearest[touches]]]
    return touching, values


def carry(x: Array, piece: Index, carried: Mask, sound: Mask, values: Array) -> Array:
    """Give each carried piece the values of what it sits on, one set for all its positions.

    That is the nearest places of other pieces with weights like those that it was matched with, if
    that was sound, which keeps a finger on a hip from being the hip's; its own where there are
    none.
    """
    loose = carried[piece]
    if not loose.any() or loose.all():
        return values
    names, group = np.unique(piece[loose], return_inverse=True)
    own = _means(group, np.where(sound[loose], 1.0, 1e-6), values[loose])
    host = np.flatnonzero(~loose)
    pick = _spread(group, ENOUGH)
    distance, index = cKDTree(x[host]).query(x[loose][pick], k=range(1, min(4, len(host)) + 1))
    found = values[host[index]]
    joints = len(JOINTS)
    unlike = np.abs(found[:, :, :joints] - own[group[pick]][:, None, :joints]).sum(axis=2)
    told = np.bincount(group, sound[loose]) > 0.5 * np.bincount(group)
    alike = (unlike < ALIKE) | ~told[group[pick], None]
    share = np.where(alike & (distance < FAR), 1.0 / (distance**2 + 1e-5), 0.0)
    total = group_sums(group[pick], share.sum(axis=1), len(names))
    means = _means(
        np.repeat(group[pick], index.shape[1]), share.ravel(), found.reshape(-1, values.shape[1])
    )
    values = values.copy()
    values[loose] = np.where(total[:, None] > 0.0, means, own)[group]
    return values


def _spread(group: Index, enough: int) -> Index:
    """Some members of each group, at least so many or all."""
    order = np.argsort(group, kind="stable")
    count = np.bincount(group)
    rank = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count)
    every = np.maximum(1, count // enough)
    return order[rank % np.repeat(every, count) == 0]


def piece_sizes(x: Array, piece: Index) -> Array:
    """``[pieces]`` diagonals of the pieces' bounding boxes."""
    order = np.argsort(piece, kind="stable")
    starts = np.flatnonzero(np.diff(piece[order], prepend=-1))
    low, high = np.minimum.reduceat(x[order], starts), np.maximum.reduceat(x[order], starts)
    sizes = np.zeros(int(piece.max()) + 1)
    sizes[piece[order[starts]]] = np.linalg.norm(high - low, axis=1)
    return sizes


def group_sums(group: Index, values: NDArray[Any], count: int) -> Array:
    """``[count]`` sums of ``values [n]`` in each group."""
    return np.bincount(group, values, minlength=count).astype(np.float64)


def _means(group: Index, share: Array, values: Array) -> Array:
    """``[g, c]`` weighted means of ``values [n, c]`` in each group; zero without any weight."""
    count = int(group.max()) + 1
    sums = csr_array((share, (group, np.arange(len(group)))), shape=(count, len(group)))
    total = np.bincount(group, share)
    return (sums @ values) / np.where(total > 0.0, total, 1.0)[:, None]
