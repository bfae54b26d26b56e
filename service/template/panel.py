"""The unit panel: a wing's section, carried from root to tip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.template.rounds import ROUND_SIDES
from service.template.unitshape import UnitShape

Array = NDArray[np.float64]


def panel(cells: tuple[int, int]) -> UnitShape:
    """A slab along x with a wing's section: y across it, leading edge at +z.

    Args:
        cells: number of faces along, and over the chord on each of the two sides.

    Returns:
        ``2 chord (along + 3)`` vertices; the flat ends have their own, so that they stay sharp.
    """
    along, chord = cells
    outline = _section(chord)
    around = len(outline)
    stations = np.linspace(-0.5, 0.5, along + 1)
    skin = np.concatenate([np.insert(outline, 0, x, axis=1) for x in stations])
    ends = [np.insert(outline, 0, x, axis=1) for x in (-0.5, 0.5)]
    cap = _cap(chord)
    faces = [_skin(around, along), len(skin) + cap, len(skin) + around + cap[:, ::-1]]
    side = np.repeat([2, 0, 1], [len(f) for f in faces])
    return UnitShape(np.concatenate([skin, *ends]), np.concatenate(faces), side, ROUND_SIDES)


def _section(chord: int) -> Array:
    """``[2 chord, 2]`` (y, z) from the leading edge over the top to the trailing edge and back.

    The thickness along the chord is that of NACA's four-digit sections with a closed trailing edge.
    """
    c = 0.5 - 0.5 * np.cos(np.pi * np.arange(chord + 1) / chord)
    half = 0.2969 * np.sqrt(c) - 0.1260 * c - 0.3516 * c**2 + 0.2843 * c**3 - 0.1036 * c**4
    half[-1] = 0.0
    half *= 0.5 / half.max()
    top = np.stack([half, 0.5 - c], axis=1)
    bottom = np.stack([-half, 0.5 - c], axis=1)
    return np.concatenate([top, bottom[-2:0:-1]])


def _skin(around: int, along: int) -> NDArray[np.int64]:
    """Triangles between consecutive sections, which run from +z over +y, clockwise from +x."""
    start = around * np.arange(along)[:, None]
    a, b = (start + np.arange(around)).ravel(), (start + np.roll(np.arange(around), -1)).ravel()
    return np.concatenate([
        np.stack([a, b + around, b], axis=1), np.stack([a, a + around, b + around], axis=1)
    ])  # fmt: skip


def _cap(chord: int) -> NDArray[np.int64]:
    """Triangles between the upper and the lower side of one section, looking to -x."""
    top = np.arange(chord + 1)
    bottom = np.concatenate([[0], np.arange(2 * chord - 1, chord, -1), [chord]])
    a, b, c, d = top[:-1], top[1:], bottom[1:], bottom[:-1]
    strip = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    # At both edges the sides meet, and one of two triangles has no area.
    whole = [len(set(triangle)) == 3 for triangle in strip.tolist()]
    return strip[np.array(whole)]
