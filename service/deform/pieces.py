"""Connected pieces of a mesh that belong together: a leg, a slat, a cushion, an arm, a screw.

A small piece follows one group of parts, as a whole, and where it is slender beside its part it is
carried, not stretched: posts move apart with a wider back but keep their section.  A piece that
makes up several parts at once, such as a whole chair in one, is left to the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.assemblies import Assemblies, hung, joined
from service.deform.choice import CARRIED, TOUCH, Cases, choose, mean_distance, realised
from service.deform.groups import Group
from service.deform.margins import FAR, anchor, margins, part_ends, passage
from service.deform.proximity import Boxes
from service.deform.thickness import set_upright, thickness
from service.deform.weld import runs

Array32 = NDArray[np.float32]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Share of the part's length over which a piece is stretched; see `CARRIED`.
STRETCHED = 0.7
# The same for a rod along its own axis, such as a spindle, which is held at both ends.
ROD = (0.1, 0.2)


@dataclass(frozen=True)
class Votes:
    """How pieces follow parts.

    Attributes:
        shares: ``[pieces, G]`` shares of the groups, one in sum, of a piece that moves as one;
            NaN for a piece that is left to its vertices.
        keep: ``[pieces, P, 3]`` 1 where a piece stretches with a part, 0 where it is carried, and
            more where it stretches between margins.
        shift: ``[pieces, P, 3]`` what unit coordinates times that are moved by; where a piece is
            carried, the place.
    """

    shares: Array32
    keep: Array32
    shift: Array32

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
    # Whatever is of vertices has them last from here on, and sorted by their pieces below.
    order, starts = runs(piece)
    u = u.transpose(1, 2, 0)
    distances, to_group = (np.stack([c[order] for c in m.T]) for m in (distances, to_group))
    counts = np.diff([*starts, len(piece)])
    nearest = np.minimum.reduceat(distances, starts, axis=1).T
    far = distances > np.repeat(nearest.T, counts, axis=1) + np.float32(TOUCH)
    (low, high), (touch_low, touch_high) = _extents(u, order, starts, far)
    made, full = realised(touch_low, touch_high, high - low, groups, boxes)
    made &= nearest < TOUCH
    full &= made
    cost = mean_distance(to_group, starts)
    free = mean_distance(to_group.min(axis=0, keepdims=True), starts)
    cases = Cases(made, full, nearest, cost, free, high - low, touching)
    shares = hung(choose(cases, groups, boxes, hubs), nearest.min(axis=1), high - low, touching)
    rods = _elongated((high - low) * boxes.sizes.astype(np.float32))
    # Nothing holds the tip of a propeller's blade, off the wing, as a spindle's ends are held.
    rods &= (_by_part(cost, groups) < 2 * TOUCH)[:, :, None] | ~boxes.rounded[:, None]
    member = _by_part(shares, groups) == 1.0
    hanging = member[:, :, None] & ~rods & (high - low < CARRIED)
    skin = _skin(cost, groups, boxes)
    skin &= ~(hubs & joined(hanging & ~skin[:, :, None], high - low, touching, thin))
    assembled = Assemblies(hanging & ~skin[:, :, None] & ~thin, touching)
    low, high = assembled.extents(low, high)
    keep = np.where(rods, passage(high - low, *ROD), passage(high - low, CARRIED, STRETCHED))
    # Timbers that run on into other parts show where this one ends, not by how much it is longer.
    split = (np.isnan(shares[:, :1]) & (nearest < TOUCH))[:, :, None]
    ends = part_ends(
        np.where(split, np.clip(touch_low, -0.5, 0.5), low),
        np.where(split, np.clip(touch_high, -0.5, 0.5), high),
        (member | split[:, :, 0]) & ~boxes.rounded,
    )
    slope, start = margins(low, high, ends)
    # What hangs from a round hub goes with its own middle, whatever it is flush with.
    middle = np.clip((low + high) / 2, -0.5, 0.5)
    place = np.where((hubs & boxes.rounded)[:, None], middle, anchor(low, high, ends))
    shift = (1.0 - keep) * place + keep * start
    keep *= slope
    low, high = set_upright(u, order, starts, low, high, boxes)
    carried = member & ~made & ~skin & boxes.rounded
    together = Assemblies(carried[:, :, None] & thin, touching)
    near = np.maximum(touch_low, low), np.minimum(touch_high, high)
    contact = together.contacts(*near, nearest)
    own, across = thickness(low, high, made, full, member, contact)
    keep = np.where(thin, own, keep)
    shift = np.where(thin, across, shift)
    left = skin | np.isnan(shares[:, :1])
    keep[left], shift[left] = 1.0, 0.0
    return Votes(shares, keep.astype(np.float32), shift.astype(np.float32))


def _skin(cost: Array32, groups: list[Group], boxes: Boxes) -> Mask:
    """``[pieces, P]`` pieces of a round or tapered part's skin, such as a flap: they stretch with
    it, lest they tear off the rest."""
    return np.asarray((_by_part(cost, groups) < TOUCH) & boxes.rounded)


def _by_part(values: Array32, groups: list[Group]) -> Array32:
    """``[pieces, P]`` of each part its group's column of ``values [pieces, G]``."""
    columns = np.empty((len(values), sum(len(g.members) for g in groups)), np.float32)
    for g, group in enumerate(groups):
        columns[:, list(group.members)] = values[:, g, None]
    return columns


def _extents(u: Array32, order: Index, starts: Index, far: Mask) -> tuple[Array32, Array32]:
    """Low and high ends of pieces, and of what is not far of them, both ``[2, pieces, P, 3]``.

    Args:
        u: ``[P, 3, n]``.
        order, starts: of the pieces; see `runs`.
        far: ``[P, n]``, in that order.
    """
    whole, near = np.empty((2, 2, len(starts), *u.shape[:2]), np.float32)
    for part, beyond in enumerate(far * np.float32(FAR)):
        for axis in range(3):
            own = u[part, axis][order]
            whole[0, :, part, axis] = np.minimum.reduceat(own, starts)
            whole[1, :, part, axis] = np.maximum.reduceat(own, starts)
            near[0, :, part, axis] = np.minimum.reduceat(own + beyond, starts)
            near[1, :, part, axis] = np.maximum.reduceat(own - beyond, starts)
    return whole, near


def _elongated(extent: Array32) -> Mask:
    """``[pieces, P, 3]`` the axes that a piece of ``extent [pieces, P, 3]`` is a rod along."""
    longest = np.argsort(extent, axis=2)[:, :, 2:]
    others = np.sort(extent, axis=2)[:, :, 1:2]
    return (np.arange(3) == longest) & (extent >= 2.0 * others)
