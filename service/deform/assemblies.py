"""Pieces of a mesh that hang together: castors and spokes, a wheel on its leg, an engine's cowls.

A piece that is carried keeps its shape and goes with one spot of its part.  Pieces that touch must
go with the same spot, lest they come apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from service.deform.choice import TOUCH

Array32 = NDArray[np.float32]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Share of the part's length under which a piece of its skin goes with what hangs there.
SMALL = 0.15
# With more pieces than this, as in a broken scan, each is carried by itself.
MANY = 1500


class Assemblies:
    """Pieces that are carried along an axis of a part, and touch."""

    def __init__(self, member: Mask, touching: Mask) -> None:
        """
        Args:
            member: ``[pieces, P, 3]`` which pieces are carried along which axes.
            touching: ``[pieces, pieces]`` which touch.
        """
        self._found: list[tuple[int, int, Index, Index]] = []
        for part, axis in np.argwhere(member.any(axis=0)).tolist():
            own = np.flatnonzero(member[:, part, axis])
            if len(own) > 1:
                links = csr_array(touching[np.ix_(own, own)])
                self._found.append(
                    (part, axis, own, connected_components(links, directed=False)[1])
                )

    def extents(self, low: Array32, high: Array32) -> tuple[Array32, Array32]:
        """``low, high [pieces, P, 3]`` with those of assemblies in place of their pieces'."""
        low, high = low.copy(), high.copy()
        for part, axis, own, label in self._found:
            bottom, top = _bounds(low[own, part, axis], high[own, part, axis], label)
            low[own, part, axis], high[own, part, axis] = bottom[label], top[label]
        return low, high

    def contacts(self, low: Array32, high: Array32, distance: Array32) -> Array32:
        """``[pieces, P, 3]`` unit coordinates nearest a part's middle where it is touched.

        Args:
            low, high: ``[pieces, P, 3]`` extents of what each piece has nearest to the part.
            distance: ``[pieces, P]`` from the part.  Of an assembly, only the pieces nearest to it
                touch.
        """
        contact: Array32 = np.clip(np.zeros_like(low), low, high)
        for part, axis, own, label in self._found:
            near, _ = _bounds(distance[own, part], distance[own, part], label)
            touch = distance[own, part] <= near[label] + np.float32(TOUCH)
            bottom = np.where(touch, low[own, part, axis], np.float32(np.inf))
            top = np.where(touch, high[own, part, axis], np.float32(-np.inf))
            ends = _bounds(bottom, top, label)
            contact[own, part, axis] = np.clip(np.zeros_like(near), *ends)[label]
        return contact


def _bounds(low: Array32, high: Array32, label: Index) -> tuple[Array32, Array32]:
    """``[labels]`` least and greatest of ``low, high [n]``."""
    bottom = np.full(label.max() + 1, np.inf, np.float32)
    top = np.full(label.max() + 1, -np.inf, np.float32)
    np.minimum.at(bottom, label, low)
    np.maximum.at(top, label, high)
    return bottom, top


def joined(hanging: Mask, extent: Array32, touching: Mask, thin: Mask) -> Mask:
    """``[pieces, P]`` small pieces that touch some that hang from a part: a strut in the belly is
    its wheel's, not the skin's.

    Args:
        hanging: ``[pieces, P, 3]`` pieces that are carried, and none of the skin.
        extent: ``[pieces, P, 3]`` in the part's lengths.
        thin: ``[P, 3]`` axes that do not count.
    """
    reached = touching.astype(np.float32) @ hanging.reshape(len(hanging), -1) > 0.0
    return np.asarray((reached.reshape(hanging.shape) & (extent < SMALL) & ~thin).any(axis=2))


def hung(shares: Array32, distance: Array32, extent: Array32, touching: Mask) -> Array32:
    """``[pieces, G]`` shares of the groups, those of pieces that touch no part from what they hang
    on: a wheel goes with its leg, though the fuselage be nearer than the wing.

    Args:
        shares: ``[pieces, G]`` by distance; NaN for a piece that is left to its vertices.
        distance: ``[pieces]`` from the nearest part.
        extent: ``[pieces, P, 3]``; of several neighbours the smallest holds.
        touching: ``[pieces, pieces]``.
    """
    shares = shares.copy()
    size = extent.max(axis=2).max(axis=1)
    settled = distance <= TOUCH
    whole = (shares == 1.0).any(axis=1)
    floating = np.flatnonzero(~settled & whole)
    while len(floating):
        holds = touching[floating] & (settled & whole)
        held = holds.any(axis=1)
        if not held.any():
            break
        by = np.where(holds, size, np.inf).argmin(axis=1)
        shares[floating[held]] = shares[by[held]]
        settled[floating[held]] = True
        floating = floating[~held]
    return shares


def touching_pieces(low: NDArray[np.float64], high: NDArray[np.float64]) -> Mask:
    """``[pieces, pieces]`` whether the bounding boxes ``low, high [pieces, 3]`` touch."""
    if len(low) > MANY:
        return np.eye(len(low), dtype=bool)
    apart = np.maximum(low[:, None] - high[None], low[None] - high[:, None])
    return np.asarray((apart < TOUCH / 2).all(axis=2))
