"""How the parts of a mirrored group share a vertex between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.groups import Group
from service.deform.proximity import Array, Array32, Boxes

# Where members cross or all but touch, the shares pass from one to the other over this length.
CROSSING = 0.1
# The most of the distance between two members' middles that is one's own, either side of it:
# thick members that all but touch would fold what is between them.
OWN = 0.15


@dataclass(frozen=True)
class Blocks:
    """The pieces of a mesh that move as one.

    Attributes:
        piece: ``[V]``.
        extent: ``[pieces, 3]`` sizes of their bounding boxes.
        one: ``[pieces]`` bool, whether a piece moves as one.
    """

    piece: NDArray[np.int64]
    extent: Array
    one: NDArray[np.bool_]

    def level(self, values: Array32, axis: int, reach: float) -> Array32:
        """``values [m, V]``, their mean on each piece no longer than `reach` along an axis."""
        compact = self.one & (self.extent[:, axis] < reach)
        if not compact.any():
            return values
        rows = np.flatnonzero(compact[self.piece])
        piece = self.piece[rows]
        count = np.maximum(np.bincount(piece, minlength=len(compact)), 1)
        for column in values:
            column[rows] = (np.bincount(piece, column[rows], len(compact)) / count)[piece]
        return values


def all_shares(u: Array32, boxes: Boxes, groups: list[Group], blocks: Blocks) -> Array32:
    """``[V, P]`` shares of the parts within their groups; see `group_shares`."""
    shares = np.ones((u.shape[1], len(u)), np.float32)
    for group in groups:
        if len(group.members) > 1:
            shares[list(group.members)] = group_shares(u, boxes, group, blocks)
    return shares.T


def group_shares(u: Array32, boxes: Boxes, group: Group, blocks: Blocks) -> Array32:
    """``[m, V]`` shares of a group's members in each vertex, one in sum.

    Between two mirrored members the share passes linearly from one to the other, so a stretcher
    between legs stretches evenly; beyond them it is the nearer one's alone.  A piece that doesn't
    reach from one to the other has one share throughout.
    """
    members = list(group.members)
    shares = np.ones((len(members), len(u)), np.float32)
    for axis, partners in group.partners.items():
        centers = boxes.frames[members, axis, 3]
        apart = float(np.abs(centers[0] - centers[partners[0]]))
        half = 0.5 * np.abs(boxes.frames[members, axis, :3]).sum(axis=1)
        if not boxes.runs_along(members[0], axis):
            half = np.minimum(half, OWN * apart)
        rows = boxes.frames[members, axis, :3].astype(np.float32)
        past = np.empty_like(shares)
        for n, member in enumerate(members):
            inward = np.sign(centers[partners[n]] - centers[n]).astype(np.float32)
            offset = sum(u[:, member, k] * (inward * rows[n, k]) for k in np.flatnonzero(rows[n]))
            np.maximum(offset - half[n].astype(np.float32), 0.0, out=past[n])
        opposite = past[list(partners)]
        width = np.float32(min(CROSSING, max(0.5 * apart - half[0], 1e-6)))
        fraction = opposite - past
        fraction /= np.maximum(past + opposite, width)
        fraction *= np.float32(0.5)
        fraction += np.float32(0.5)
        shares *= blocks.level(fraction, axis, 0.5 * apart)
    shares /= np.maximum(shares.sum(axis=0), np.float32(1e-12))
    return shares
