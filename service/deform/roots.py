"""Where parts leave the hub: a wing is longer from the fuselage's side on, not from within it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from service.deform.groups import hub_parts
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

# A part begins inside the hub when it does so within this share of the hub's half size.
SUNK = 0.99


def rooted(template: AffineTemplate, f: Array) -> tuple[AffineTemplate, Array]:
    """The template with the parts that are measured from a hub's side beginning there.

    Such a part starts inside the hub, lest a gap show, and its end keeps its distance from the
    hub's side whatever the hub's size.  Template vertices inside the hub are never seen, but a
    mesh's wing may end at the fuselage's skin: that has to stay there.

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
    for hub in np.flatnonzero(hub_parts(template)):
        for part, run in enumerate(template.run):
            side = _side(frames[hub, run], frames[part, run], run, at)
            if part == hub or side is None:
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


def _side(hub: Array, part: Array, run: np.int64, at: Array) -> Array | None:
    """``[1 + d]`` the hub's side that a part is measured from, of rows ``[4, 1 + d]`` along its
    run; None for a part that isn't."""
    start, end = _start(part, run), part[3] + 0.5 * part[run]
    half = 0.5 * hub[run] * np.sign(hub[run] @ at)
    side: Array = hub[3] + half * np.sign((end - hub[3]) @ at)
    measured = not (end - side)[hub[run] != 0.0].any()
    inside = abs((start - hub[3]) @ at) < SUNK * (half @ at) < abs((end - hub[3]) @ at)
    return side if measured and inside else None


def _start(row: Array, run: np.int64) -> Array:
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
