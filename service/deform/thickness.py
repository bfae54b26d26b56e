"""Across a part: which pieces are as thick as it is, and which keep a section of their own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.deform.margins import passage
from service.deform.proximity import Boxes

Array32 = NDArray[np.float32]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Share of the thickest piece across a part under which one keeps its section, as spindles do.
SECTION = (0.4, 0.75)
# Pieces as thick as so much of the part are centred on it, wherever the fit has its middle.
CENTRED = (0.7, 0.9)
# A piece is beside a part when less than this share of it lies within its thickness.
BESIDE = 0.5
# A piece leans otherwise than a part when upright it is as much thinner.
LEANS = 0.9


def thickness(
    low: Array32, high: Array32, made: Mask, full: Mask, member: Mask, contact: Array32
) -> tuple[Array32, Array32]:
    """How far pieces thicken with the parts that they make up, and what is added to that.

    A piece in a part is as thick as the part, unless others are much thicker; else, and where it
    lies beside the part, it is carried.

    Args:
        low, high: ``[pieces, P, 3]`` ends of the pieces; see `set_upright`.
        made, full: ``[pieces, P]`` the parts that a piece makes up, and those that it does alone.
        member: ``[pieces, P]`` the parts that a piece follows.
        contact: ``[pieces, P, 3]`` unit coordinates nearest a part's middle where it is touched.

    Returns:
        The slope and the shift of their unit coordinates, both ``[pieces, P, 3]``.
    """
    extent, center = high - low, np.clip((low + high) / 2, -0.5, 0.5)
    inside = np.clip(high, -0.5, 0.5) - np.clip(low, -0.5, 0.5)
    within = (made & member)[:, :, None] & (inside >= BESIDE * extent)
    most = np.where(within, np.clip(extent, 1e-3, 1.0), 1e-3).max(axis=0)
    slope = within * passage(extent / most, *SECTION)
    # What makes up no part is carried at the spot where it touches.
    place = np.where(made[:, :, None], center, np.clip(contact, -0.5, 0.5))
    # Bars and posts are off the middle that they were straightened by, a whole back is not.
    off = center * passage(extent, *CENTRED) * ~full[:, :, None]
    shift = (1.0 - slope) * place - slope * off
    return slope, shift.astype(np.float32)


def set_upright(
    u: Array32, order: Index, starts: Index, low: Array32, high: Array32, boxes: Boxes
) -> tuple[Array32, Array32]:
    """``low, high [pieces, P, 3]``, across flat parts those of the pieces set upright: a bar or a
    cushion that leans otherwise than the back has the thickness that it has.

    Args:
        u: ``[P, 3, n]`` unit coordinates.
        order, starts: of the pieces; see `runs`.
        low, high: ends of the pieces.
        boxes: of the parts.
    """
    low, high = low.copy(), high.copy()
    flat = (boxes.thin.sum(axis=1) == 1) & ~boxes.rounded
    for part in np.flatnonzero(flat).tolist():
        thin = int(boxes.thin[part].argmax())
        own = u[part, thin][order]
        for along in {0, 1, 2} - {thin}:
            own = _upright(own, u[part, along][order], starts)
        low[:, part, thin] = np.minimum.reduceat(own, starts)
        high[:, part, thin] = np.maximum.reduceat(own, starts)
    return low, high


def _upright(across: Array32, along: Array32, starts: Index) -> Array32:
    """``across [n]`` less each piece's lean with ``along [n]``, where that makes it thinner."""
    counts = np.diff([*starts, len(across)]).astype(np.float32)
    times = counts.astype(np.int64)

    def mean(values: Array32) -> Array32:
        return np.asarray(np.add.reduceat(values, starts) / counts, np.float32)

    def extent(values: Array32) -> Array32:
        most, least = (end.reduceat(values, starts) for end in (np.maximum, np.minimum))
        return np.asarray(most - least, np.float32)

    offset = along - np.repeat(mean(along), times)
    lean = mean(offset * across) / (mean(offset * offset) + np.float32(1e-4))
    upright: Array32 = (across - np.repeat(lean, times) * offset).astype(np.float32)
    thinner = extent(upright) < LEANS * extent(across)
    return np.where(np.repeat(thinner, times), upright, across)
