"""Where along a part its pieces end: they keep their margins to it, and each other's contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array32 = NDArray[np.float32]
Mask = NDArray[np.bool_]

# A piece that nearly fills a part, such as a cushion on a seat or a bar between posts, keeps its
# margins: its ends go with the part's from such a share of the part's length on.
MARGINS = (0.6, 0.8)
# What pieces show of where a part ends is off the fit by no more than this.
OFF = 0.1
# Beyond any unit coordinate.
FAR = 1e9


def passage(fill: Array32, carried: float, stretched: float) -> Array32:
    """A smooth step from 0 at `carried` to 1 at `stretched`."""
    s = np.clip((fill - carried) / (stretched - carried), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def part_ends(low: Array32, high: Array32, member: Mask) -> Array32:
    """``[2, P, 3]`` where parts end, as the pieces have it that follow them and lie in them.

    Args:
        low, high: ``[pieces, P, 3]`` ends of the pieces in unit coordinates.
        member: ``[pieces, P]`` the parts that a piece follows.
    """
    inside = np.clip(high, -0.5, 0.5) - np.clip(low, -0.5, 0.5)
    within = member[:, :, None] & (inside >= 0.5 * (high - low))
    bottom = np.where(within, low, FAR).min(axis=0)
    top = np.where(within, high, -FAR).max(axis=0)
    known = top - bottom > 1.0 - 2 * OFF
    ends = np.where(known, [bottom, top], np.array([-0.5, 0.5])[:, None, None])
    return np.clip(ends, [[[-0.5 - OFF]], [[0.5 - OFF]]], [[[OFF - 0.5]], [[0.5 + OFF]]])


def margins(low: Array32, high: Array32, ends: Array32) -> tuple[Array32, Array32]:
    """Slope and shift, ``[pieces, P, 3]``, that take a piece's ends to the part's, as far as it
    fills the part: a cushion stays as far inside of a wider seat's edge as it was."""
    low, high = (np.clip(end, *ends) for end in (low, high))
    fill = np.maximum(high - low, np.float32(0.1))
    whole = ends[1] - ends[0]
    kept = passage(fill / whole, *MARGINS)
    slope = whole / fill
    return 1.0 + kept * (slope - 1.0), kept * (ends[0] - low * slope)


def anchor(low: Array32, high: Array32, ends: Array32) -> Array32:
    """``[pieces, P, 3]`` where along a part a piece is carried: at its side where it is flush."""
    center, middle = (low + high) / 2, ends.mean(axis=0)
    most = (ends[1] - ends[0]) / 2
    half = np.minimum((high - low) / 2, 0.9 * most)
    flush = np.clip((center - middle) / (most - half), -1.0, 1.0)
    return np.where(high - low < 2 * most, middle + flush * most, np.clip(center, *ends))
