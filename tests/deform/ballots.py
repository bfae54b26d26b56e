"""How the pieces of a mesh vote, for the tests of this folder."""

from __future__ import annotations

import numpy as np
from boxes import ORIGIN
from numpy.typing import NDArray

from service.deform.assemblies import touching_pieces
from service.deform.binding import inverse_frames
from service.deform.groups import hub_parts, mirror_groups
from service.deform.loft import lofts
from service.deform.pieces import Votes, vote
from service.deform.proximity import Boxes, group_distance
from service.deform.roots import rooted
from service.deform.weld import Welded, weld
from service.template.affine import AffineTemplate


def votes_of(
    template: AffineTemplate,
    f: NDArray[np.float64],
    mesh: tuple[NDArray[np.float64], NDArray[np.int64]],
) -> tuple[Welded, Votes]:
    """The votes on a mesh placed like the template, which is not straightened."""
    welded = weld(*mesh)
    cut, starts = rooted(template, f)
    maps = cut.maps(f)
    found = lofts(template, f, maps.frames, maps.tapers, starts)
    boxes = Boxes(maps.frames, inverse_frames(maps.frames), found)
    x = welded.vertices - ORIGIN
    u = boxes.local(x)
    groups = mirror_groups(cut)
    distances = boxes.distances(u)
    to_group = np.stack([group_distance(x, distances, boxes, g) for g in groups], axis=1)
    touching = touching_pieces(*welded.boxes())
    hubs = hub_parts(cut)
    return welded, vote(u, distances, to_group, welded.piece, touching, groups, boxes, hubs)
