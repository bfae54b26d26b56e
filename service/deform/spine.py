"""The middle line or surface of a part as the mesh has it: legs splay, backs lean and bow.

A template's parts are straight.  Measured from plane sections of the mesh, the middle of the real
part, as a function of the part's long axes, straightens the unit coordinates: a splayed leg then
thickens about its own axis.  Wings lean with the fit already, and are left as they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.deform.groups import Group
from service.deform.proximity import Boxes
from service.deform.sections import cut
from service.deform.spinefit import COLUMNS, LEVELS, REACH, Spine, centers, fit_spine

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# A section belongs to a part when its extent is within these factors of the part's.
LEAST, MOST = 0.4, 2.2


def straighten(
    u: NDArray[np.float32],
    faces: Index,
    boxes: Boxes,
    groups: list[Group],
    fixed: NDArray[np.bool_],
) -> dict[int, Spine]:
    """Straighten, in place, the unit coordinates ``u [n, P, 3]`` of all parts but the `fixed`.

    Returns:
        The spines of the parts that the mesh was found to have, by the part.
    """
    spines: dict[int, Spine] = {}
    for group in groups:
        for part in group.members:
            if fixed[part] or boxes.swept(part):
                continue
            mirrored = np.full(3, np.nan)
            for axis, partners in group.partners.items():
                if boxes.runs_along(part, axis):
                    continue
                row = np.abs(boxes.frames[part, axis, :3])
                along = int(row.argmax())
                size = np.copysign(boxes.sizes[part, along], boxes.frames[part, axis, along])
                partner = group.members[partners[group.members.index(part)]]
                apart = boxes.frames[partner, axis, 3] - boxes.frames[part, axis, 3]
                mirrored[along] = 0.5 * apart / size
            run = boxes.lofts[part].run if boxes.rounded[part] else 1
            spine = measure_spine(u[:, part], faces, boxes.sizes[part], mirrored, run)
            if spine is not None:
                for axis, shift in zip(spine.thin, spine.shift(u[:, part]).T, strict=True):
                    u[:, part, axis] -= shift
                spines[part] = spine
    return spines


def measure_spine(
    u: NDArray[np.float32], faces: Index, size: Array, mirrored: Array, run: int
) -> Spine | None:
    """Measure a part's middle on a mesh, or None where the mesh has no such sections.

    Args:
        u: ``[n, 3]`` the mesh's welded vertices in the part's unit coordinates.
        faces: ``[F, 3]``.
        size: ``[3]`` lengths of the part's axes.
        mirrored: ``[3]`` unit coordinates of the template's mirror planes, where the part has an
            image beyond; NaN elsewhere.  What straddles them belongs to no one part.
        run: the axis to cut across; the longest instead where it is one of the thin.
    """
    thin = tuple(int(axis) for axis in np.flatnonzero(size < 0.4 * size.max()))
    long = [axis for axis in range(3) if axis not in thin]
    if not thin or len(thin) == 3:
        return None
    run = run if run in long else long[int(size[long].argmax())]
    wide = next((axis for axis in long if axis != run), None)
    near = _near(u, faces, size, run)
    if not len(near):
        return None
    samples = _samples(*_alone(u, near), size, mirrored, run, wide, thin)
    return fit_spine(*samples, size, run, wide, thin)


def _near(u: NDArray[np.float32], faces: Index, size: Array, run: int) -> Index:
    """Faces that reach into the part's surroundings."""
    reach = (0.5 + REACH / size).astype(np.float32)
    reach[run] = 0.5
    # One bit for each side of the surroundings that a vertex is beyond: a face is away when all
    # of its corners are beyond the same side.
    beyond = np.zeros(len(u), np.uint8)
    for axis in range(3):
        beyond |= (u[:, axis] < -reach[axis]).view(np.uint8) << 2 * axis
        beyond |= (u[:, axis] > reach[axis]).view(np.uint8) << 2 * axis + 1
    a, b, c = (np.take(beyond, corner) for corner in faces.T)
    near = np.flatnonzero((a & b & c) == 0)
    return np.stack([np.take(corner, near) for corner in faces.T], axis=1)


def _alone(u: NDArray[np.float32], faces: Index) -> tuple[Array, Index]:
    """The vertices of some faces, in their order, and the faces with indices into them."""
    used = np.zeros(len(u), bool)
    for corner in faces.T:
        used[corner] = True
    vertex = np.flatnonzero(used)
    place = np.empty(len(u), np.int64)
    place[vertex] = np.arange(len(vertex))
    return np.stack([column[vertex] for column in u.T], axis=1).astype(np.float64), place[faces]


def _samples(
    u: Array,
    faces: Index,
    size: Array,
    mirrored: Array,
    run: int,
    wide: int | None,
    thin: tuple[int, ...],
) -> tuple[Index, Array]:
    """Boxes round the sections: their grid cell ``[m, 2]``, and low and high ``[m, 2, thin]``."""
    sections = cut(u, faces, run, centers(LEVELS))
    column = np.zeros(len(sections.points), np.int64)
    columns = 1
    if wide is not None:
        columns = COLUMNS
        at = (sections.points[:, wide] + 0.5) * COLUMNS
        column = np.clip(np.floor(at), 0, COLUMNS - 1).astype(np.int64)
        # Half a cell beyond the sides the part ends.
        outside = (at < -0.5) | (at > COLUMNS + 0.5)
        column[outside] = -1
    keep = column >= 0
    points = sections.points[keep]
    key = sections.curve[keep] * columns + column[keep]
    groups, index = np.unique(key, return_inverse=True)
    low = np.full((len(groups), 3), np.inf)
    high = np.full((len(groups), 3), -np.inf)
    np.minimum.at(low, index, points)
    np.maximum.at(high, index, points)
    level = np.zeros(len(groups), np.int64)
    level[index] = sections.plane[keep]
    straddles = ((low < mirrored) & (high > mirrored)).any(axis=1)
    extent = (high - low)[:, thin]
    fits = ((extent > LEAST) & (extent < MOST)).all(axis=1) & ~straddles
    cells = np.stack([level, groups % columns], axis=1)
    box = np.stack([low[:, thin], high[:, thin]], axis=1)
    return cells[fits], box[fits]
