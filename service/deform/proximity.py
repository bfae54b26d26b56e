"""How near mesh vertices are to a template's parts, and what each part says of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from service.deform.binding import FLOOR
from service.deform.groups import Group
from service.deform.loft import Loft

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]

# How much of the distance to a part counts for a vertex between the mirrored parts of a group,
# such as one of a stretcher between legs.
BETWEEN = 0.5
# Distance over which a part's hold on its surroundings fades.
BAND = 0.02
# An axis counts as thin under this share of the part's longest.
THIN = 0.4


# Vertices at a time, so that what is worked out of them stays in the processor's cache.
BLOCK = 16384


def blocks(count: int) -> list[slice]:
    """Slices of so many vertices, one after another."""
    return [slice(start, min(start + BLOCK, count)) for start in range(0, count, BLOCK)]


@dataclass(frozen=True)
class Boxes:
    """The parts' bounding boxes at the bound parameters.

    Attributes:
        frames: ``[P, 3, 4]``.
        inverses: ``[P, 3, 3]``.
        lofts: the parts that are more than their boxes.
    """

    frames: Array
    inverses: Array
    lofts: dict[int, Loft] = field(default_factory=dict)

    @property
    def sizes(self) -> Array:
        """``[P, 3]`` lengths of the boxes' axes, none shorter than what the inverses assume."""
        sizes: Array = np.maximum(np.linalg.norm(self.frames[:, :, :3], axis=1), FLOOR)
        return sizes

    @property
    def thin(self) -> NDArray[np.bool_]:
        """``[P, 3]`` the axes across slender and flat parts."""
        sizes = self.sizes
        thin: NDArray[np.bool_] = sizes < THIN * sizes.max(axis=1, keepdims=True)
        return thin

    @property
    def long(self) -> NDArray[np.bool_]:
        """``[P, 3]`` the axes that what makes up a part runs along."""
        long: NDArray[np.bool_] = ~self.thin
        for part in np.flatnonzero(self.rounded).tolist():
            # A fuselage runs along a fin's chord without being a fin.
            long[part] = np.arange(3) == self.lofts[part].run
        return long

    def local(self, x: Array) -> Array32:
        """Unit coordinates ``[V, P, 3]`` of ``x [V, 3]``, each one in a run of memory of its own.

        Here and below it is the loops over these runs that make a large mesh quick to bind.
        """
        u = np.empty((len(self.frames), 3, len(x)), np.float32)
        columns = np.ascontiguousarray(x.T)
        for rows in blocks(len(x)):
            for part, own in enumerate(u):
                own[:, rows] = self.unit(part, columns[:, rows])
        return u.transpose(2, 0, 1)

    def unit(self, part: int, x: Array) -> Array32:
        """Unit coordinates ``[3, n]`` in one part of ``x [3, n]``."""
        if part in self.lofts and self.lofts[part].tapered:
            return self.lofts[part].unit(x.T).T
        u = np.empty(x.shape, np.float32)
        for own, row in zip(u, self.inverses[part], strict=True):
            terms = [row[k] * x[k] for k in np.flatnonzero(row)]
            own[:] = sum(terms) - row @ self.frames[part, :, 3]
        return u

    def distances(self, u: Array32) -> Array32:
        """Distances ``[V, P]`` to the parts of points with unit coordinates ``u [V, P, 3]``."""
        distances = np.empty((u.shape[1], len(u)), np.float32)
        sizes = self.sizes.astype(np.float32)
        for rows in blocks(len(u)):
            for part, size in enumerate(sizes):
                if part in self.lofts:
                    distances[part, rows] = self.lofts[part].distance(u[rows, part])
                    continue
                beyond = np.maximum(np.abs(u[rows, part].T) - np.float32(0.5), 0.0)
                beyond *= size[:, None]
                np.sqrt(np.square(beyond, out=beyond).sum(axis=0), out=distances[part, rows])
        return distances.T

    def runs_along(self, part: int, axis: int) -> bool:
        """Whether a part lies along an axis of space, as a wing does: its image across that axis
        is beyond its own end."""
        return bool(self.rounded[part]) and self.lofts[part].run == axis

    @property
    def rounded(self) -> NDArray[np.bool_]:
        """``[P]`` which are no boxes, tapering or not."""
        round_ = [part for part, loft in self.lofts.items() if loft.outline is not None]
        return np.isin(np.arange(len(self.frames)), round_)

    def swept(self, part: int) -> bool:
        """Whether a part is round and tapers, such as a wing: it leans as the fit has it."""
        return bool(self.rounded[part]) and self.lofts[part].tapered

    def end_to_end(self, group: Group) -> bool:
        """Whether a group's members do, such as wings: they meet in the middle."""
        return any(self.runs_along(group.members[0], axis) for axis in group.partners)


def nearness(to_group: Array32, band: Array32 | float = BAND) -> Array32:
    """``[V, G]`` smooth shares of the groups, one in sum, from the distances to them.

    Inverse sixth powers, not a Gaussian: between parts far off, such as along an arm between seat
    and back, the shares pass over as slowly as the distances are large.

    Args:
        to_group: ``[V, G]``.
        band: distance over which a group's hold fades, ``[V, G]`` or one for all.
    """
    least = to_group.min(axis=1, keepdims=True)
    near = (least + band) / (to_group + band)
    cubed = near * near * near
    near = cubed * cubed
    return near / near.sum(axis=1, keepdims=True)


def group_distance(x: Array, distances: Array32, boxes: Boxes, group: Group) -> Array32:
    """``[V]`` distance to a group: between its members, less than to the nearest of them.

    What is between wings is the fuselage's: for them it is the distance to the nearest.
    """
    members = list(group.members)
    nearest = distances[:, members[0]]
    for part in members[1:]:
        nearest = np.minimum(nearest, distances[:, part])
    if len(members) == 1 or boxes.end_to_end(group):
        return nearest
    half = 0.5 * np.abs(boxes.frames[members, :, :3]).sum(axis=2)
    center = boxes.frames[members, :, 3]
    low, high = (center - half).min(axis=0), (center + half).max(axis=0)
    hull = np.zeros(len(x))
    for coordinate, below, above in zip(x.T, low, high, strict=True):
        hull += (coordinate - np.clip(coordinate, below, above)) ** 2
    return np.minimum(nearest, np.sqrt(hull, dtype=np.float32) + np.float32(BETWEEN) * nearest)
