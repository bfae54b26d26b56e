"""Which group of parts each connected piece of a mesh goes with, if it is one."""

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
# mean square over and above what its vertices need: from a box, and from a part that is known to be
# no box.
BEYOND = (0.06, 0.02)
# Share of a piece that is within a flat arm which it makes up with others, and of a part's length
# and breadth which one piece covers that lies at its side.
SLIM, COVERS = 0.25, 0.7
# Share of the part's length under which a piece is carried.
CARRIED = 0.4
# How near a strut's ends come to what it holds, and the share of a wing under which it is none.
MEETS, SHORT = 0.024, 0.2


@dataclass(frozen=True)
class Cases:
    """What is known of the pieces.

    Attributes:
        made: ``[pieces, P]`` the parts that a piece makes up, some with others.
        full: ``[pieces, P]`` those that it makes up by itself.
        nearest: ``[pieces, P]`` least distances to the parts.
        cost: ``[pieces, G]`` mean distances to the groups.
        free: ``[pieces, 1]`` mean of each vertex's distance to the group nearest to it.
        extent: ``[pieces, P, 3]`` sizes in the parts' unit coordinates.
        touching: ``[pieces, pieces]`` which touch.
    """

    made: Mask
    full: Mask
    nearest: Array32
    cost: Array32
    free: Array32
    extent: Array32
    touching: Mask


def choose(cases: Cases, groups: list[Group], boxes: Boxes, hubs: Mask) -> Array32:
    """``[pieces, G]`` 1 for the group that a piece goes with; NaN for a piece that is left to its
    vertices.

    Args:
        hubs: ``[P]`` parts that the others are attached to.
    """
    members = [list(group.members) for group in groups]
    makes = np.stack([cases.made[:, m].any(axis=1) for m in members], axis=1)
    apart = np.array([len(g.members) > 1 and not boxes.end_to_end(g) for g in groups])
    spans = np.stack([(cases.nearest[:, m] < TOUCH).sum(axis=1) > 1 for m in members], axis=1)
    spans &= apart
    # A template's arm may be a box from the top of an armrest to below the seat: what is in it and
    # reaches from leg to leg is a rail.
    solid = np.array([cases.full[:, m].any() for m in members])
    spans &= solid | ~(spans & solid).any(axis=1, keepdims=True)
    makes &= solid | ~apart | ~(spans & solid).any(axis=1, keepdims=True)
    # A piece that makes up a part goes with that part, one from leg to leg with the legs, others
    # with what is clearly nearest.
    chosen = _clearly_nearest(cases, groups, boxes, hubs)
    chosen = np.where(np.any(spans, axis=1)[:, None], spans, chosen)
    chosen = np.where(np.any(makes, axis=1)[:, None], makes, chosen)
    # A post that runs on from a leg into the back makes up the leg, and still belongs to both.
    beyond = np.array([BEYOND[int(boxes.rounded[m[0]])] for m in members], np.float32)
    alone = np.where(makes, cases.cost, np.inf)
    best = alone.argmin(axis=1)[:, None]
    alone = np.take_along_axis(alone, best, axis=1)
    chosen |= np.isfinite(alone) & (alone > cases.free + beyond[best])
    shares = chosen.astype(np.float32)
    shares[chosen.sum(axis=1) > 1] = np.nan
    return shares


def _clearly_nearest(cases: Cases, groups: list[Group], boxes: Boxes, hubs: Mask) -> Mask:
    """``[pieces, G]`` the group nearest to a piece, and others that are hardly farther."""
    least, factor = cases.cost.min(axis=1, keepdims=True), np.float32(CLEARLY[0])
    close = cases.cost <= factor * least + np.float32(CLEARLY[1])
    # Between the hub and a lone part, such as an arm between seat and back, the hub holds; between
    # the hub and mirrored parts, as under a seat, each vertex decides.
    hub = np.array([hubs[list(g.members)].any() for g in groups])
    several = np.array([len(g.members) > 1 for g in groups])
    held = np.any(close & hub, axis=1) & ~np.any(close & several, axis=1)
    close = np.where(held[:, None], hub, close)
    compact = np.flatnonzero(_compact(cases, close, groups, boxes))
    close[compact] = np.eye(len(groups), dtype=bool)[_together(cases, compact)]
    return np.asarray(close | _bridged(cases, groups, boxes, hubs))


def _compact(cases: Cases, close: Mask, groups: list[Group], boxes: Boxes) -> Mask:
    """``[pieces]`` such as a wheel or an engine beside a wing's root: they reach from one part to
    the other no more than they are part of the skin of both."""
    compact = np.zeros(len(close), bool)
    reaching = (cases.cost < TOUCH).sum(axis=1) > 1
    for g, group in enumerate(groups):
        if boxes.end_to_end(group):
            part = group.members[0]
            compact |= close[:, g]
            reaching |= close[:, g] & (cases.extent[:, part, boxes.lofts[part].run] >= CARRIED)
    return compact & ~reaching


def _together(cases: Cases, compact: Index) -> Index:
    """``[n]`` the group nearest to compact pieces, one for all that touch, such as the rings of an
    engine."""
    links = csr_array(cases.touching[np.ix_(compact, compact)])
    count, label = connected_components(links, directed=False)
    total = np.zeros((count, cases.cost.shape[1]))
    np.add.at(total, label, cases.cost[compact] ** 2)
    nearest: Index = total.argmin(axis=1)[label]
    return nearest


def _bridged(cases: Cases, groups: list[Group], boxes: Boxes, hubs: Mask) -> Mask:
    """``[pieces, G]`` hub and wing for a strut from one to the other, off both but for its ends."""
    members = [list(group.members) for group in groups]
    met = np.stack([cases.nearest[:, m].min(axis=1) < MEETS for m in members], axis=1)
    met &= (cases.cost > TOUCH).all(axis=1, keepdims=True)
    hub = np.array([hubs[m].any() for m in members])
    bridged = np.zeros_like(met)
    for g, group in enumerate(groups):
        if boxes.end_to_end(group):
            part = group.members[0]
            long = cases.extent[:, part, boxes.lofts[part].run] > SHORT
            strut = long & met[:, g] & (met & hub).any(axis=1)
            bridged[strut] |= hub | (np.arange(len(groups)) == g)
    return bridged


def realised(
    low: Array32, high: Array32, extent: Array32, groups: list[Group], boxes: Boxes
) -> tuple[Mask, Mask]:
    """``[pieces, P]`` whether what lies inside a part runs along it and through its middle, and
    whether it does so along all of it.

    Args:
        low, high: ``[pieces, P, 3]`` ends of what touches a part.
        extent: ``[pieces, P, 3]`` sizes of the pieces.
        groups, boxes: of the parts.
    """
    thin = boxes.thin
    inside = np.clip(high, -0.5, 0.5) - np.clip(low, -0.5, 0.5)
    along = (inside >= 0.5) & boxes.long
    # Not beside the part, as a seat is below a back.
    within = ((inside >= 0.3 * (high - low)) & (np.abs(low + high) < 0.999)) | thin
    centered = (np.abs(low + high) <= 0.7) | (high - low >= 0.6) | ~thin
    made = along.any(axis=2) & (centered & within).all(axis=2)
    full = (along | ~boxes.long).all(axis=2)
    # A seat runs along the arms beside it, and is none.
    flat = boxes.long.sum(axis=1) > 1
    sides = [part for g in groups if len(g.members) > 1 for part in g.members if flat[part]]
    slim = np.asarray(((inside >= SLIM * extent) | ~thin).all(axis=2))
    made[:, sides] &= (full | slim)[:, sides]
    # What covers all of a flat part is of it, be it a board at its lower side.
    made |= flat & ((inside >= COVERS) | thin).all(axis=2)
    return made, made & full


def mean_distance(distance: Array32, starts: Index) -> Array32:
    """``[pieces, m]`` root mean squares over each piece of ``distance [m, n]``."""
    counts = np.diff([*starts, distance.shape[1]])
    mean: Array32 = np.sqrt(np.add.reduceat(distance**2, starts, axis=1) / counts).T
    return mean
