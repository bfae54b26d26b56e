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
        """``values [V, m]``, their mean on each piece no longer than `reach` along an axis."""
        compact = self.one & (self.extent[:, axis] < reach)
        rows = np.flatnonzero(compact[self.piece])
        if not len(rows):
            return values
        piece = self.piece[rows]
        count = np.maximum(np.bincount(piece, minlength=len(compact)), 1)
        means = np.stack(
            [np.bincount(piece, column, len(compact)) / count for column in values[rows].T], axis=1
        )
        values[rows] = means[piece]
        return values


def all_shares(u: Array32, boxes: Boxes, groups: list[Group], blocks: Blocks) -> Array32:
    """``[V, P]`` shares of the parts within their groups; see `group_shares`."""
    shares = np.empty(u.shape[:2], np.float32)
    for group in groups:
        shares[:, list(group.members)] = group_shares(u, boxes, group, blocks)
    return shares


def group_shares(u: Array32, boxes: Boxes, group: Group, blocks: Blocks) -> Array32:
    """``[V, m]`` shares of a group's members in each vertex, one in sum.

    Between two mirrored members the share passes linearly from one to the other, so a stretcher
    between legs stretches evenly; beyond them it is the nearer one's alone.  A piece that doesn't
    reach from one to the other has one share throughout.
    """
    members = list(group.members)
    shares = np.ones((len(u), len(members)), np.float32)
    for axis, partners in group.partners.items():
        centers = boxes.frames[members, axis, 3]
        apart = float(np.abs(centers[0] - centers[partners[0]]))
        half = 0.5 * np.abs(boxes.frames[members, axis, :3]).sum(axis=1)
        if not boxes.runs_along(members[0], axis):
            half = np.minimum(half, OWN * apart)
        row = boxes.frames[members, axis, :3].astype(np.float32)
        inward = np.sign(centers[list(partners)] - centers)
        offset = np.einsum("vmk,mk->vm", u[:, members], row) * inward.astype(np.float32)
        past = np.maximum(offset - half.astype(np.float32), 0.0)
        opposite = past[:, list(partners)]
        total = past + opposite
        width = np.float32(min(CROSSING, max(0.5 * apart - half[0], 1e-6)))
        fraction = np.float32(0.5) + np.float32(0.5) * (opposite - past) / np.maximum(total, width)
        shares *= blocks.level(fraction, axis, 0.5 * apart)
    total = shares.sum(axis=1, keepdims=True)
    return shares / np.maximum(total, np.float32(1e-12))
