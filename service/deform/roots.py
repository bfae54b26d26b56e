"""Where parts leave the hub: a wing is longer from the fuselage's skin on, not from within it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from service.deform.groups import hub_parts
from service.deform.loft import Outline, outline_of
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

# A part begins inside the hub when it does so within this share of the hub's half size.
SUNK = 0.99
TINY = 1e-9


def rooted(template: AffineTemplate, f: Array) -> tuple[AffineTemplate, Array]:
    """The template with the parts that come out of a hub beginning at its skin.

    Such a part starts inside the hub, lest a gap show, and template vertices there are never seen;
    but a mesh's wing may end at the fuselage's skin, and that has to stay there.

    Args:
        template: the category's.
        f: ``[d]`` parameters, at which the parts' maps stay what they are.

    Returns:
        The template with other frames and tapers, not other vertices, and ``[P]`` where along its
        run each part of it begins in the given one's unit coordinates: -1/2 for most.
    """
    frames = np.concatenate([template.frame_base[..., None], template.frame_jacobian], axis=-1)
    tapers = np.concatenate([template.taper_base[..., None], template.taper_jacobian], axis=-1)
    starts = np.full(len(frames), -0.5)
    at = np.concatenate([[1.0], f])
    for hub in np.flatnonzero(hub_parts(template)).tolist():
        outline = outline_of(template, f, hub)
        for part, run in enumerate(template.run.tolist()):
            if part == hub or (outline is not None and run == template.run[hub]):
                continue
            side = _side(frames[hub], frames[part], run, at, outline, int(template.run[hub]))
            if side is None:
                continue
            start, length = _start(frames[part, run], run) @ at, frames[part, run, run] @ at
            starts[part] = (side @ at - start) / length - 0.5
            frames[part], tapers[part] = _cut(frames[part], tapers[part], run, starts[part], side)
    cut = replace(
        template,
        frame_base=frames[..., 0],
        frame_jacobian=np.ascontiguousarray(frames[..., 1:]),
        taper_base=tapers[..., 0],
        taper_jacobian=np.ascontiguousarray(tapers[..., 1:]),
    )
    return cut, starts


def _side(
    hub: Array, part: Array, run: int, at: Array, outline: Outline | None, hub_run: int
) -> Array | None:
    """``[1 + d]`` where a part comes out of the hub, along its run; None for a part that doesn't.

    A part whose length counts from the hub's side, as a wing's does, begins there whatever its
    level; another where the skin is at its own.

    Args:
        hub, part: ``[3, 4, 1 + d]`` rows of their frames.
    """
    start, end = _start(part[run], run), part[run, 3] + 0.5 * part[run, run]
    toward = np.sign((end - hub[run, 3]) @ at) * np.sign(hub[run, run] @ at)
    counted = end - hub[run, 3] - 0.5 * toward * hub[run, run]
    measured = not counted[hub[run, run] != 0.0].any()
    u = 0.5 * toward
    if outline is not None:
        u = _skin(hub, part, run, at, outline, hub_run, toward, level=not measured)
    elif not measured:
        return None
    side: Array = hub[run, 3] + u * hub[run, run]
    inside = abs((start - hub[run, 3]) @ at) < SUNK * abs((side - hub[run, 3]) @ at)
    beyond = abs((side - hub[run, 3]) @ at) < abs((end - hub[run, 3]) @ at)
    return side if inside and beyond else None


def _skin(
    hub: Array, part: Array, run: int, at: Array, outline: Outline, hub_run: int, toward: float,
    level: bool,
) -> float:  # fmt: skip
    """Unit coordinate along `run` of a round hub's skin where a part begins: the section's side
    there, or at the part's own level of it.  In the middle where the part is beside the hub."""
    begin = (part[:, 3] - 0.5 * part[:, run]) @ at
    unit = (begin - hub[:, 3] @ at) / (np.diagonal(hub[:, :3]).T @ at)
    center, half = (row[:, 0] for row in outline.at(unit[hub_run : hub_run + 1].astype(np.float32)))
    across = [axis for axis in range(3) if axis != hub_run]
    own, other = across.index(run), 1 - across.index(run)
    round_off = 1.0
    if level:
        off = (unit[across[other]] - center[other]) / max(half[other], TINY)
        round_off = np.sqrt(max(1.0 - off**2, 0.0))
    return float(center[own] + toward * half[own] * round_off)


def _start(row: Array, run: int) -> Array:
    start: Array = row[3] - 0.5 * row[run]
    return start


def _cut(
    frame: Array, taper: Array, run: np.int64, start: np.float64, side: Array
) -> tuple[Array, Array]:
    """Rows of the frame and the taper of a part from ``start`` to its end."""
    begin, end = frame[:, 3] + start * frame[:, run], frame[:, 3] + 0.5 * frame[:, run]
    begin[run] = side
    short = frame + 0.5 * (start + 0.5) * np.pad(taper, ((0, 0), (0, 1), (0, 0)))
    short[:, 3], short[:, run] = (begin + end) / 2, end - begin
    return short, (0.5 - start) * taper
