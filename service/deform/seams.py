"""Where parts meet flush: the strips of a part that move with the part standing on them.

A leg of a template is carried by a wider seat, while the seat's own corner above it is stretched;
the two slip past each other, and a mesh that is one piece through both would shear or fold.  Over
the strip that a flush neighbour covers the part is carried too, and the stretch is left to the
rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from service.deform.groups import offered_rows
from service.deform.proximity import Boxes
from service.deform.spinefit import Spine
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]

# The most of a part that one strip may take.
WIDEST = 0.4


@dataclass(frozen=True)
class Seams:
    """Carried strips: ``low`` and ``high``, both ``[P, 3]``, where the stretch begins and ends."""

    low: Array32
    high: Array32

    def carry(self, u: Array32) -> tuple[Array32, Array32]:
        """Unit coordinates ``[n, P, 3]`` with the strips pressed to the sides, and the slope.

        Beyond the part's box coordinates are as they were.
        """
        slope = 1.0 / (self.high - self.low)
        inner = (u - self.low) * slope - np.float32(0.5)
        beyond = u - np.clip(u, -0.5, 0.5)
        gain = np.where((u > self.low) & (u < self.high), slope, (beyond != 0.0).astype(np.float32))
        return np.clip(inner, -0.5, 0.5) + beyond, gain


def flush_seams(template: AffineTemplate, boxes: Boxes, spines: dict[int, Spine]) -> Seams:
    """Strips of those parts that are axis-aligned boxes.

    A neighbour counts whose side moves with the part's side, whatever users change.  The strip
    reaches to its inner face, further in where the mesh's own neighbour is known to stand there.
    """
    affine = offered_rows(template)
    frames, rounded = boxes.frames, boxes.rounded
    low, high = np.full((len(frames), 3), -0.5), np.full((len(frames), 3), 0.5)
    for part, axis in np.ndindex(len(frames), 3):
        row = affine[part, axis]
        # Only axes that the part's frame doesn't turn.
        if rounded[part] or not row[axis].any() or np.delete(row[:3], axis, 0).any():
            continue
        for other, side in product(np.flatnonzero(~rounded).tolist(), (-1.0, 1.0)):
            if other == part or not _flush(row, affine[other, axis], axis, side):
                continue
            run, spine = int(template.run[other]), spines.get(other)
            inner = _inner_face(frames[other], axis, side, run, spine)
            edge = float(boxes.local(inner[None])[0, part, axis])
            # A mirrored part's own axis points the other way.
            if side * frames[part, axis, axis] < 0 and edge + 0.5 <= WIDEST:
                low[part, axis] = max(low[part, axis], edge)
            elif side * frames[part, axis, axis] > 0 and 0.5 - edge <= WIDEST:
                high[part, axis] = min(high[part, axis], edge)
    return Seams(low.astype(np.float32), high.astype(np.float32))


def _flush(row: Array, beside: Array, axis: int, side: float) -> bool:
    """Whether two parts' rows ``[4, 1 + d]`` of an axis put their faces of a side in one place."""
    return np.allclose(
        row[3] + side * 0.5 * np.abs(row[axis]), beside[3] + side * 0.5 * np.abs(beside[axis])
    )


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
