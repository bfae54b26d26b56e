"""The blend rule: each vertex moves with a smooth blend of its parts' affine maps.

1. The mesh is welded and cut into connected pieces (`weld`); parts that are measured from the
   hub's side begin there (`roots`), and round and tapered ones are what they are (`loft`).
2. Unit coordinates in each part are straightened along the mesh's own legs and back (`spine`).
3. Pieces that belong to one group of parts follow it as a whole (`pieces`), but for their rounded
   edges (`rims`); of others each vertex follows the parts that it is near (`proximity`, `seams`,
   `discord`).
4. Beyond a part stretch ends (`clamp`), and mirrored parts share what is between them (`shares`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from service.deform.assemblies import touching_pieces
from service.deform.binding import Binding, inverse_frames
from service.deform.clamp import saturate, stretch_limits
from service.deform.compilation import Compiler, Field, Moves
from service.deform.discord import discord
from service.deform.groups import Group, hub_parts, mirror_groups
from service.deform.loft import lofts
from service.deform.pieces import Votes, vote
from service.deform.proximity import BAND, Boxes, blocks, group_distance, nearness
from service.deform.rims import Rim, find_rims
from service.deform.roots import rooted
from service.deform.seams import Seams, flush_seams
from service.deform.shares import Blocks, all_shares
from service.deform.spine import straighten
from service.deform.spinefit import Spine
from service.deform.sweep import swept
from service.deform.weld import weld
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
    fit = replace(fit, template=swept(fit.template, f, fit.boxes, u, welded.faces))
    hubs = hub_parts(fit.template)
    spines = straighten(u, welded.faces, fit.boxes, fit.groups, hubs)
    distances = fit.boxes.distances(u)
    to_group = np.stack([group_distance(x, distances, fit.boxes, group) for group in fit.groups]).T
    low, high = welded.boxes()
    votes = vote(
        u, distances, to_group, welded.piece, touching_pieces(low, high), fit.groups,
        fit.boxes, hubs,
    )  # fmt: skip
    shares = all_shares(u, fit.boxes, fit.groups, Blocks(welded.piece, high - low, votes.whole))
    rims = find_rims(welded, u, votes, fit.groups, fit.boxes)
    following = _Following.of(fit, spines, votes, rims)
    compiler = Compiler(fit.template, fit.boxes, fit.groups, len(x))
    for rows in blocks(len(x)):
        compiler.add(
            rows, *following.of_some(u[rows], welded.piece[rows], to_group[rows], shares[rows])
        )
    return compiler.binding(welded)


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


@dataclass(frozen=True)
class _Following:
    """How vertices follow the parts, once it is known what the pieces do.

    Attributes:
        groups: of the parts.
        votes: of the pieces.
        rims: of pieces that have some.
        moves: of the parts with the parameters.
        limits, reach: of the parts' stretch; see `saturate`.
        seams: where parts meet flush.
        offered: ``[d]`` fitted parameters, 0 for those that users don't change.
    """

    groups: list[Group]
    votes: Votes
    rims: list[Rim]
    moves: Moves
    limits: Array32
    reach: Array32
    seams: Seams
    offered: Array

    @classmethod
    def of(cls, fit: _Fit, spines: dict[int, Spine], votes: Votes, rims: list[Rim]) -> _Following:
        limits, reach = stretch_limits(fit.boxes, fit.groups, spines)
        seams = flush_seams(fit.template, fit.boxes, spines)
        offered = np.where(fit.template.public, fit.f, 0.0)
        moves = Moves.of(fit.template)
        return cls(fit.groups, votes, rims, moves, limits, reach, seams, offered)

    def of_some(
        self, u: Array32, piece: NDArray[np.int64], to_group: Array32, shares: Array32
    ) -> tuple[list[Field], Array32, Array32, Array32, Array32]:
        """What `Compiler.add` takes of some vertices.

        Args:
            u: ``[n, P, 3]`` straightened unit coordinates.
            piece: ``[n]``.
            to_group: ``[n, G]`` distances to the groups.
            shares: ``[n, P]`` of the parts in their groups.
        """
        u = u.copy(order="K")
        slopes = [(rim, *rim.hold(u, piece)) for rim in self.rims]
        votes, present = self.votes, np.flatnonzero(np.bincount(piece))
        as_is = (votes.keep[present] == 1.0) & (votes.shift[present] == 0.0)
        placed = [
            (part, axis, votes.keep[:, part, axis][piece], votes.shift[:, part, axis][piece])
            for part, axis in np.argwhere(~as_is.all(axis=0)).tolist()
        ]
        for part, axis, keep, shift in placed:
            u[:, part, axis] = keep * u[:, part, axis] + shift
        local, gains = saturate(u, self.limits, self.reach)
        for rim, rows, slope in slopes:
            gains[rows, rim.part, rim.axis] *= slope
        for part, axis, keep, _ in placed:
            gains[:, part, axis] *= keep
        free = ~votes.whole[piece]
        if free.any():
            self.seams.carry(local, gains, free)
        fields = self.moves.fields(self.groups, shares, local)
        near = np.stack([share[piece] for share in votes.shares.T])
        if free.any():
            band = BAND + DISCORD * discord(fields, to_group, self.offered)
            np.copyto(near, nearness(to_group, band).T, where=free)
        near = near.T
        return fields, shares, near, local, gains
