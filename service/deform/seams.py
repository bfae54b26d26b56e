"""Where parts meet flush: the strips of a part that move with the part standing on them.

A leg of a template is carried by a wider seat, while the seat's own corner above it is stretched;
the two slip past each other, and a mesh that is one piece through both would shear or fold.  Over
the strip that a flush neighbour covers the part is carried too, and the stretch is left to the
rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.groups import offered_rows, slack_rows
from service.deform.proximity import Boxes
from service.deform.spinefit import Spine
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]
Mask = NDArray[np.bool_]

# The most of a part that one strip may take.
WIDEST = 0.4
SIDES = (-1.0, 1.0)


@dataclass(frozen=True)
class Seams:
    """Carried strips: ``low`` and ``high``, both ``[P, 3]``, where the stretch begins and ends."""

    low: Array32
    high: Array32

    def carry(self, u: Array32, gains: Array32, free: Mask) -> None:
        """Press the strips to the sides, in place.

        Beyond the part's box coordinates stay as they are.

        Args:
            u, gains: ``[n, P, 3]`` unit coordinates and how far they follow the part.
            free: ``[n]`` the vertices that are carried like this.
        """
        for part, axis in np.argwhere((self.low > -0.5) | (self.high < 0.5)):
            own, low, high = u[:, part, axis], self.low[part, axis], self.high[part, axis]
            slope = np.float32(1.0) / (high - low)
            within = np.clip(own, -0.5, 0.5)
            pressed = np.clip((own - low) * slope - np.float32(0.5), -0.5, 0.5) + (own - within)
            gain = np.where((own > low) & (own < high), slope, (own != within).astype(np.float32))
            np.copyto(own, pressed, where=free)
            np.multiply(gains[:, part, axis], gain, out=gains[:, part, axis], where=free)


def flush_seams(template: AffineTemplate, boxes: Boxes, spines: dict[int, Spine]) -> Seams:
    """Strips of those parts that are axis-aligned boxes.

    A neighbour counts whose side moves with the part's side, whatever users change.  The strip
    reaches to its inner face, further in where the mesh's own neighbour is known to stand there.
    """
    affine = offered_rows(template)
    frames, rounded = boxes.frames, boxes.rounded
    flush = _flush(affine, slack_rows(template).max(axis=2))
    low, high = np.full((len(frames), 3), -0.5), np.full((len(frames), 3), 0.5)
    for part, axis in np.ndindex(len(frames), 3):
        row = affine[part, axis]
        # Only axes that the part's frame doesn't turn.
        if rounded[part] or not row[axis].any() or np.delete(row[:3], axis, 0).any():
            continue
        for n, other in np.argwhere(flush[:, axis, part] & ~rounded).tolist():
            if other == part:
                continue
            side = SIDES[n]
            run, spine = int(template.run[other]), spines.get(other)
            inner = _inner_face(frames[other], axis, side, run, spine)
            edge = float(boxes.unit(part, inner[:, None])[axis, 0])
            # A mirrored part's own axis points the other way.
            if side * frames[part, axis, axis] < 0 and edge + 0.5 <= WIDEST:
                low[part, axis] = max(low[part, axis], edge)
            elif side * frames[part, axis, axis] > 0 and 0.5 - edge <= WIDEST:
                high[part, axis] = min(high[part, axis], edge)
    return Seams(low.astype(np.float32), high.astype(np.float32))


def _flush(affine: Array, slack: Array) -> Mask:
    """``[2, 3, P, P]`` whether two parts, whose rows ``[P, 3, 4, 1 + d]`` are given, have their
    faces of a side and an axis in one place, but for a slack of ``[P, 3, 1 + d]``."""
    half = 0.5 * np.abs(np.diagonal(affine[:, :, :3], axis1=1, axis2=2)).transpose(0, 2, 1)
    faces = np.stack([affine[:, :, 3] + side * half for side in SIDES]).swapaxes(1, 2)
    apart = np.abs(faces[:, :, :, None] - faces[:, :, None])
    room = np.maximum(slack[:, None], slack[None]).transpose(2, 0, 1, 3)
    return np.asarray((apart <= room + 1e-9).all(axis=-1))


def _inner_face(frame: Array, axis: int, side: float, run: int, spine: Spine | None) -> Array:
    """``[3]`` a point of a neighbour's inner face, where it is attached, as the mesh has it."""
    # The end nearest the origin is where it is attached.
    end = -0.5 if frame[run, 3] * frame[run, run] > 0 else 0.5
    point = frame[:, 3] + end * frame[:, run]
    inward = 0.5 * abs(frame[axis, axis])
    if spine is not None and axis in spine.thin:
        at = 0 if frame[spine.run, 3] * frame[spine.run, spine.run] > 0 else -1
        middle = spine.middle[at, :, spine.thin.index(axis)].mean()
        inward += max(-side * middle * frame[axis, axis], 0.0)
    point[axis] -= side * inward
    return point
