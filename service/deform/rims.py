"""The rims of pieces: rounded edges, which keep their radius when the rest is stretched.

A wider seat or cushion of a mesh is wider between its rims.  A rim is told by the surface's turning
towards a piece's end over a short way, with a flat stretch behind it; what is round all over, such
as a bolster or a turned leg, has none, nor has a rod.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.groups import Group
from service.deform.normals import face_crosses
from service.deform.pieces import Votes
from service.deform.proximity import Boxes
from service.deform.weld import Welded

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# A surface turns towards an end where its normal has so much along the axis: more where it is not
# quite flat elsewhere.
TURNED = (0.04, 0.12)
# The widest rim, in normalised length, and as a share of the piece.
WIDEST, SHARE = 0.05, 0.25
# Shorter pieces, and those of which one side is twice as long as both others, have no rims.
SHORT, ROD = 0.1, 2.0
# What is between the rims stretches no more than so many times as much, lest it fold when the whole
# shrinks; wider rims give way a little.
MOST = 1.5
TINY = 1e-12


@dataclass(frozen=True)
class Rim:
    """How pieces are held at their ends along one axis of one part.

    Attributes:
        part, axis: of the unit coordinates.
        has: ``[pieces]`` which pieces are.
        knots: ``[pieces, 4]`` unit coordinates of the ends and of where the rims begin.
        held: ``[pieces, 4]`` where those go, so that the displacement is theirs.
    """

    part: int
    axis: int
    has: Mask
    knots: Array32
    held: Array32

    def hold(self, u: Array32, piece: Index) -> tuple[Index, Array32]:
        """Press coordinates together at the rims and apart between them, in place.

        Args:
            u: ``[n, P, 3]`` unit coordinates.
            piece: ``[n]``.

        Returns:
            Rows that are changed, and by how much more they follow the part's stretch.
        """
        rows = np.flatnonzero(self.has[piece])
        knots, held = self.knots[piece[rows]], self.held[piece[rows]]
        own = u[rows, self.part, self.axis]
        # Where there is no rim, the end itself is of what lies between.
        span = (own >= knots[:, 1]).astype(np.int64) + (own > knots[:, 2])
        at = np.arange(len(rows))
        start, end = knots[at, span], knots[at, span + 1]
        slope = (held[at, span + 1] - held[at, span]) / np.maximum(end - start, np.float32(1e-6))
        u[rows, self.part, self.axis] = held[at, span] + slope * (own - start)
        return rows, slope


def find_rims(
    welded: Welded, u: Array32, votes: Votes, groups: list[Group], boxes: Boxes
) -> list[Rim]:
    """The rims of those pieces that follow one part as a whole.

    Args:
        welded: the mesh.
        u: ``[n, P, 3]`` straightened unit coordinates.
        votes: of the pieces.
        groups: of the parts.
        boxes: of the parts.
    """
    low, high = welded.boxes()
    size = np.sort(high - low, axis=1)
    solid = votes.whole & (size[:, 2] > SHORT) & (size[:, 2] < ROD * size[:, 1])
    if not solid.any():
        return []
    faces = _Faces.of(welded, solid)
    rims = []
    for g, group in enumerate(groups):
        follows = np.flatnonzero(solid & (votes.shares[:, g] > 0.5))
        for part in group.members:
            if boxes.rounded[part] or not len(follows):
                continue
            for axis in range(3):
                rim = _rim(u, faces, votes, boxes, part, axis, follows)
                if rim is not None:
                    rims.append(rim)
    return rims


@dataclass(frozen=True)
class _Faces:
    """The faces of some pieces.

    Attributes:
        corners: ``[F, 3]`` of those that have an area, piece by piece.
        normals: ``[F, 3]`` of length 1.
        starts, ends: ``[pieces]`` where each piece's begin and end.
    """

    corners: Index
    normals: Array
    starts: Index
    ends: Index

    @classmethod
    def of(cls, welded: Welded, chosen: Mask) -> _Faces:
        corners = welded.faces[chosen[welded.piece[welded.faces[:, 0]]]]
        normals = face_crosses(welded.vertices, corners)
        length = np.linalg.norm(normals, axis=1)
        wide = length > TINY
        corners, normals = corners[wide], normals[wide] / length[wide, None]
        piece = welded.piece[corners[:, 0]]
        order = np.argsort(piece, kind="stable")
        starts, ends = np.searchsorted(
            piece[order], [np.arange(welded.pieces), np.arange(welded.pieces) + 1]
        )
        return cls(corners[order], normals[order], starts, ends)


def _rim(
    u: Array32, faces: _Faces, votes: Votes, boxes: Boxes, part: int, axis: int, follows: Index
) -> Rim | None:
    count = len(faces.starts)
    has, knots = np.zeros(count, bool), np.zeros((count, 4), np.float32)
    held = np.zeros_like(knots)
    # Of what leans, some lean with the part and some stand upright: see which is nearer.
    along = np.stack([boxes.frames[part, :, axis], boxes.inverses[part, axis]])
    size = max(float(np.linalg.norm(along[0])), TINY)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), TINY)
    for piece in follows[votes.keep[follows, part, axis] > 0.5].tolist():
        rows = slice(faces.starts[piece], faces.ends[piece])
        own = u[:, part, axis][faces.corners[rows]]
        if not len(own):
            continue
        turned = np.abs(faces.normals[rows] @ along.T).min(axis=1)
        most = min(WIDEST / size, SHARE * float(np.ptp(own)))
        depth = [_depth(side * own, turned, most) for side in (-1.0, 1.0)]
        if max(depth) <= 0.0:
            continue
        has[piece] = True
        knots[piece], held[piece] = _knots(float(own.min()), float(own.max()), *depth)
    return Rim(part, axis, has, knots, held) if has.any() else None


def _depth(own: Array32, turned: Array, most: float) -> float:
    """How far a rim reaches in from the end of faces with corners ``own [F, 3]``; 0 for none."""
    below = own.max() - own.min(axis=1)
    for least in TURNED:
        near = below[(turned > least) & (below < 2.0 * most)]
        depth = float(near.max()) if len(near) else 0.0
        if depth <= most:
            return depth
    return 0.0


def _knots(low: float, high: float, first: float, last: float) -> tuple[list[float], list[float]]:
    """`Rim.knots` and `Rim.held` of rims so deep at both ends."""
    whole, rims = high - low, first + last
    middle = whole - rims
    # The rims don't stretch at all, or as much as the middle leaves to them.
    slope = max(0.0, (whole - MOST * middle) / rims)
    knots = [low, low + first, high - last, high]
    held = [low, low + slope * first, high - slope * last, high]
    return knots, held
