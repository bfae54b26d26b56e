"""Connected pieces of a mesh that belong together: a leg, a slat, a cushion, an arm, a screw.

A small piece follows one group of parts, as a whole, and where it is slender beside its part it is
carried, not stretched: posts move apart with a wider back but keep their section.  A piece that
makes up several parts at once, such as a whole chair in one, is left to the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from service.deform.groups import Group
from service.deform.proximity import Boxes

Array32 = NDArray[np.float32]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Normalised length that counts as touching.
TOUCH = 0.012
# A piece goes with the nearest group when the next is this much farther, by factor and length.
CLEARLY = (1.25, 0.02)
# A piece that makes up a part is left to its vertices when it runs on so far from it, as a root
# mean square over and above what its vertices need.
BEYOND = 0.06
# Shares of the part's length under which a piece is carried, and over which it is stretched.
CARRIED, STRETCHED = 0.4, 0.7
# The same for a rod along its own axis, such as a spindle, which is held at both ends.
ROD = (0.1, 0.2)
# With more pieces than this, as in a broken scan, each is carried by itself.
MANY = 1500


@dataclass(frozen=True)
class Votes:
    """How pieces follow parts.

    Attributes:
        shares: ``[pieces, G]`` shares of the groups, one in sum, of a piece that moves as one;
            NaN for a piece that is left to its vertices.
        keep: ``[pieces, P, 3]`` 1 where a piece stretches with a part, 0 where it is carried.
        anchor: ``[pieces, P, 3]`` unit coordinates at which it is carried.
    """

    shares: Array32
    keep: Array32
    anchor: Array32

    @property
    def whole(self) -> Mask:
        """``[pieces]`` which move as one."""
        return ~np.isnan(self.shares[:, 0])


def vote(
    u: Array32,
    distances: Array32,
    to_group: Array32,
    piece: Index,
    touching: Mask,
    groups: list[Group],
    boxes: Boxes,
    hubs: Mask,
) -> Votes:
    """Decide how each piece follows the parts.

    Args:
        u: ``[n, P, 3]`` straightened unit coordinates.
        distances: ``[n, P]`` to the parts' boxes.
        to_group: ``[n, G]`` to the groups.
        piece: ``[n]``.
        touching: ``[pieces, pieces]`` which pieces touch.
        boxes: of the parts.
        hubs: ``[P]`` parts that the others are attached to.
    """
    thin = boxes.thin
    order = np.argsort(piece, kind="stable")
    starts = np.flatnonzero(np.diff(piece[order], prepend=-1))
    u, distances = u[order], distances[order]
    nearest = np.minimum.reduceat(distances, starts)
    low, high = _extent(u, None, starts)
    near = distances <= np.repeat(nearest, np.diff([*starts, len(u)]), axis=0) + np.float32(TOUCH)
    touch_low, touch_high = _extent(u, near, starts)
    made = np.asarray(nearest < TOUCH) & _realised(touch_low, touch_high, thin)
    shares = _shares(made, nearest, to_group[order], starts, groups, hubs)
    # Where a piece makes up the part, it is as thick as the part; else it is carried at the spot
    # nearest the part's middle where it touches.
    member = _membership(shares, groups)
    long = _elongated((high - low) * boxes.sizes.astype(np.float32))
    low, high = _assemble(low, high, member[:, :, None] & ~long, touching, thin)
    keep = np.where(long, _stretch(high - low, *ROD), _stretch(high - low, CARRIED, STRETCHED))
    center, half = (low + high) / 2, np.minimum((high - low) / 2, 0.45)
    flush = np.clip(center / (np.float32(0.5) - half), -1.0, 1.0)
    anchor = np.where(high - low < 1.0, flush * 0.5, np.clip(center, -0.5, 0.5))
    contact = np.clip(np.clip(0.0, touch_low, touch_high), -0.5, 0.5)
    attached = thin & ~made[:, :, None]
    keep = np.where(thin, made[:, :, None], keep)
    anchor = np.where(attached, contact, anchor)
    left = np.isnan(shares[:, 0])
    keep[left] = 1.0
    return Votes(shares, keep.astype(np.float32), anchor.astype(np.float32))


def _extent(u: Array32, mask: Mask | None, starts: Index) -> tuple[Array32, Array32]:
    low = u if mask is None else np.where(mask[:, :, None], u, np.float32(np.inf))
    high = u if mask is None else np.where(mask[:, :, None], u, np.float32(-np.inf))
    return np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)


def _stretch(fill: Array32, carried: float, stretched: float) -> Array32:
    s = np.clip((fill - carried) / (stretched - carried), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def _elongated(extent: Array32) -> Mask:
    """``[pieces, P, 3]`` the axes that a piece of ``extent [pieces, P, 3]`` is a rod along."""
    longest = np.argsort(extent, axis=2)[:, :, 2:]
    others = np.sort(extent, axis=2)[:, :, 1:2]
    return (np.arange(3) == longest) & (extent >= 2.0 * others)


def _realised(low: Array32, high: Array32, thin: Mask) -> Mask:
    """``[pieces, P]`` whether what lies inside a part runs along it and through its middle."""
    inside = np.clip(high, -0.5, 0.5) - np.clip(low, -0.5, 0.5)
    along = (inside >= 0.5) & ~thin
    # Not beside the part, as a seat is below a back.
    within = ((inside >= 0.3 * (high - low)) & (np.abs(low + high) < 0.999)) | thin
    centered = (np.abs(low + high) <= 0.7) | (high - low >= 0.6) | ~thin
    return along.any(axis=2) & (centered & within).all(axis=2)


def _shares(
    made: Mask, nearest: Array32, to_group: Array32, starts: Index, groups: list[Group], hubs: Mask
) -> Array32:
    makes = np.stack([made[:, list(g.members)].any(axis=1) for g in groups], axis=1)
    spans = np.stack(
        [(nearest[:, list(g.members)] < TOUCH).sum(axis=1) > 1 for g in groups], axis=1
    )
    counts = np.diff([*starts, len(to_group)])
    cost = np.sqrt(np.add.reduceat(to_group**2, starts) / counts[:, None])
    least, factor = cost.min(axis=1, keepdims=True), np.float32(CLEARLY[0])
    close = cost <= factor * least + np.float32(CLEARLY[1])
    # Between the hub and a lone part, such as an arm between seat and back, the hub holds; between
    # the hub and mirrored parts, as under a seat, each vertex decides.
    hub = np.array([hubs[list(g.members)].any() for g in groups])
    several = np.array([len(g.members) > 1 for g in groups])
    held = np.any(close & hub, axis=1) & ~np.any(close & several, axis=1)
    close = np.where(held[:, None], hub, close)
    # A piece that makes up a part goes with that part, one from leg to leg with the legs, others
    # with what is clearly nearest.
    chosen = np.where(np.any(spans, axis=1)[:, None], spans, close)
    chosen = np.where(np.any(makes, axis=1)[:, None], makes, chosen)
    # A post that runs on from a leg into the back makes up the leg, and still belongs to both.
    free = np.sqrt(np.add.reduceat(to_group.min(axis=1) ** 2, starts) / counts)
    alone = np.where(makes, cost, np.inf).min(axis=1)
    beyond = np.isfinite(alone) & (alone > free + np.float32(BEYOND))
    chosen |= beyond[:, None]
    shares = chosen.astype(np.float32)
    shares[chosen.sum(axis=1) > 1] = np.nan
    return shares


def _membership(shares: Array32, groups: list[Group]) -> Mask:
    """``[pieces, P]`` whether a piece as a whole goes with a part's group."""
    member = np.zeros((len(shares), sum(len(g.members) for g in groups)), bool)
    for g, group in enumerate(groups):
        member[:, list(group.members)] = shares[:, g, None] == 1.0
    return member


def _assemble(
    low: Array32, high: Array32, member: Mask, touching: Mask, thin: Mask
) -> tuple[Array32, Array32]:
    """Extents of assemblies in place of those of their pieces.

    Pieces that are carried along an axis and touch, such as the castors and the spokes of a
    swivel base, are carried together; ``member [pieces, P, 3]`` says which may be.
    """
    low, high = low.copy(), high.copy()
    for part, axis in np.argwhere(~thin):
        carried = np.flatnonzero(
            member[:, part, axis] & (high[:, part, axis] - low[:, part, axis] < CARRIED)
        )
        if len(carried) < 2:
            continue
        links = csr_array(touching[np.ix_(carried, carried)])
        _, label = connected_components(links, directed=False)
        bottom, top = np.full(label.max() + 1, np.inf), np.full(label.max() + 1, -np.inf)
        np.minimum.at(bottom, label, low[carried, part, axis])
        np.maximum.at(top, label, high[carried, part, axis])
        low[carried, part, axis], high[carried, part, axis] = bottom[label], top[label]
    return low, high


def touching_pieces(low: NDArray[np.float64], high: NDArray[np.float64]) -> Mask:
    """``[pieces, pieces]`` whether the bounding boxes ``low, high [pieces, 3]`` touch."""
    if len(low) > MANY:
        return np.eye(len(low), dtype=bool)
    apart = np.maximum(low[:, None] - high[None], low[None] - high[:, None])
    return np.asarray((apart < TOUCH / 2).all(axis=2))
