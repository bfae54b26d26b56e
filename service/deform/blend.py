"""The blend rule: each vertex moves with a smooth blend of its parts' affine maps.

1. The mesh is welded and cut into connected pieces (`weld`); parts that are measured from the
   hub's side begin there (`roots`), and round and tapered ones are what they are (`loft`).
2. Unit coordinates in each part are straightened along the mesh's own legs and back (`spine`).
3. Pieces that belong to one group of parts follow it as a whole (`pieces`); of others each vertex
   follows the parts that it is near (`proximity`, `seams`, `discord`).
4. Beyond a part stretch ends (`clamp`), and mirrored parts share what is between them (`shares`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.binding import Binding, inverse_frames
from service.deform.clamp import saturate, stretch_limits
from service.deform.compilation import compile_binding
from service.deform.discord import discord, group_fields
from service.deform.groups import Group, hub_parts, mirror_groups
from service.deform.loft import lofts
from service.deform.pieces import Votes, touching_pieces, vote
from service.deform.proximity import BAND, Boxes, group_distance, nearness
from service.deform.roots import rooted
from service.deform.seams import flush_seams
from service.deform.shares import Blocks, all_shares
from service.deform.spine import straighten
from service.deform.spinefit import Spine
from service.deform.weld import Welded, weld
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]

# Where groups disagree on a strong edit, the passage from one to the other is wider by this much
# of the disagreement, lest the surface fold.
DISCORD = 0.5


def bind(
    vertices: Array, faces: NDArray[np.int64], template: AffineTemplate, f: Array, t: Array
) -> Binding:
    """Bind a mesh to a fitted template, once for all edits.

    Args:
        vertices: ``[V, 3]`` finite, in the normalised canonical frame (+Y up, +Z front, radius
            0.6).
        faces: ``[F, 3]``; none for a cloud of points.
        f: ``[d]`` fitted parameters, in the same scale.
        t: ``[3]`` where the template's origin lies.
    """
    welded = weld(np.asarray(vertices, np.float64), np.asarray(faces, np.int64))
    f = np.asarray(f, np.float64)
    x = welded.vertices - np.asarray(t, np.float64)
    fit = _fit(template, f)
    u = fit.boxes.local(x)
    hubs = hub_parts(fit.template)
    spines = straighten(u, welded.faces, fit.boxes, fit.groups, hubs)
    distances = fit.boxes.distances(u)
    to_group = np.stack(
        [group_distance(x, distances, fit.boxes, group) for group in fit.groups], axis=1
    )
    low, high = welded.boxes()
    votes = vote(
        u, distances, to_group, welded.piece, touching_pieces(low, high), fit.groups,
        fit.boxes, hubs,
    )  # fmt: skip
    blocks = Blocks(welded.piece, high - low, votes.whole)
    shares = all_shares(u, fit.boxes, fit.groups, blocks)
    local, gains, near = _follow(fit, welded, u, to_group, spines, votes, shares)
    weights = shares.copy()
    for g, group in enumerate(fit.groups):
        weights[:, list(group.members)] *= near[:, g, None]
    bound = compile_binding(fit.template, fit.boxes, weights, local, gains)
    return Binding(bound.jacobian[welded.of], bound.gains[welded.of], bound.stretches)


@dataclass(frozen=True)
class _Fit:
    template: AffineTemplate
    f: Array
    boxes: Boxes
    groups: list[Group]


def _fit(template: AffineTemplate, f: Array) -> _Fit:
    cut, starts = rooted(template, f)
    maps = cut.maps(f)
    parts = lofts(template, f, maps.frames, maps.tapers, starts)
    boxes = Boxes(maps.frames, inverse_frames(maps.frames), parts)
    return _Fit(cut, f, boxes, mirror_groups(cut))


def _follow(
    fit: _Fit,
    welded: Welded,
    u: Array32,
    to_group: Array32,
    spines: dict[int, Spine],
    votes: Votes,
    shares: Array32,
) -> tuple[Array32, Array32, Array32]:
    """Where each part carries each vertex, the gains, and the groups' shares ``[n, G]``."""
    local, gains = saturate(u, *stretch_limits(fit.boxes, fit.groups, spines))
    keep, anchor = votes.keep[welded.piece], votes.anchor[welded.piece]
    local = anchor + keep * (local - anchor)
    gains = keep * gains
    near = votes.shares[welded.piece]
    free = np.flatnonzero(~votes.whole[welded.piece])
    if len(free):
        seams = flush_seams(fit.template, fit.boxes, spines)
        local[free], slope = seams.carry(local[free])
        gains[free] *= slope
        fields = group_fields(fit.template, shares[free], local[free], fit.groups)
        offered = np.where(fit.template.public, fit.f, 0.0)
        band = BAND + DISCORD * discord(fields, to_group[free], offered)
        near[free] = nearness(to_group[free], band)
    return local, gains, near
