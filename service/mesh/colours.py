"""Colours of vertices: from what files say on a screen's curve to the light that glTF counts in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Colours = NDArray[np.float64]

# sRGB (IEC 61966-2-1): straight up to here, then a power.
STRAIGHT = 0.04045
BYTE = 255.0


def linear(srgb: Colours) -> Colours:
    """Values of the sRGB curve, of any shape and from 0 to 1, as shares of light."""
    return np.where(srgb <= STRAIGHT, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def as_light(values: NDArray[Any], whole: float | None = None) -> Colours:
    """``[V, 3]`` or ``[V, 4]`` linear colours, from 0 to 1.

    Args:
        values: red, green, blue, and alpha where there is one, on the sRGB curve.
        whole: what stands for 1; without it, 1 itself, or 255 where some value is more.

    Returns:
        Without alpha where that is 1 throughout, or 0: nobody means what isn't seen at all.
    """
    shares = np.nan_to_num(values.astype(np.float64), nan=1.0, posinf=1.0, neginf=0.0)
    if whole is None:
        whole = BYTE if shares.max(initial=0.0) > 1.0 else 1.0
    shares = np.clip(shares / whole, 0.0, 1.0)
    light = linear(shares[:, :3])
    alpha = shares[:, 3:]
    if not alpha.size or alpha.min() == 1.0 or alpha.max() == 0.0:
        return light
    return np.concatenate([light, alpha], axis=1)
