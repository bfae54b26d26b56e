"""Where the stretch of a part ends: beyond it a mesh is carried along, not stretched further."""

from __future__ import annotations

import numpy as np

from service.deform.groups import Group
from service.deform.proximity import Array32, Boxes
from service.deform.spinefit import Spine

# Length over which the stretch ends beyond a part of which only the fitted box is known, and the
# share of its thickness where the mesh's own is.
MARGIN = 0.03
BEYOND = 0.15
# Between mirrored parts the shares pass from one to the other, so stretch ends at their faces.
INWARD = 0.05


def stretch_limits(
    boxes: Boxes, groups: list[Group], spines: dict[int, Spine]
) -> tuple[Array32, Array32]:
    """Where the parts' stretch ends and how softly: the `limits` and `reach` of `saturate`."""
    limits = np.full(boxes.sizes.shape, 0.5, np.float32)
    reach = np.minimum(0.5, MARGIN / np.maximum(boxes.sizes, 1e-9))
    for part, spine in spines.items():
        limits[part, list(spine.thin)] = np.maximum(0.5, spine.half)
        reach[part, list(spine.thin)] = BEYOND
    both = np.stack([reach, reach]).astype(np.float32)
    for group in groups:
        for axis in group.partners:
            for part in group.members:
                row = boxes.frames[part, axis, :3]
                along = int(np.abs(row).argmax())
                inward = int(row[along] * boxes.frames[part, axis, 3] < 0.0)
                both[inward, part, along] = INWARD
    return limits, both


def saturate(u: Array32, limits: Array32, reach: Array32) -> tuple[Array32, Array32]:
    """Clamp unit coordinates smoothly, so that beyond a part the displacement goes on as a
    translation.

    Args:
        u: ``[V, P, 3]``.
        limits: ``[P, 3]`` how far from the middle the part extends.
        reach: ``[2, P, 3]`` how far beyond them the clamp takes hold, on the low and high side.

    Returns:
        Clamped coordinates and their derivatives, both ``[V, P, 3]``.
    """
    count, parts, _ = u.shape
    clamped, gains = np.empty((2, parts, 3, count), np.float32)
    for part, axis in np.ndindex(parts, 3):
        own, limit = u[:, part, axis], limits[part, axis]
        low, high = reach[:, part, axis]
        beyond = np.maximum(np.abs(own) - limit, 0.0)
        room = low if low == high else np.where(own < 0.0, low, high)
        gain = np.exp(-beyond / room, out=gains[part, axis])
        inner = np.clip(own, -limit, limit)
        np.add(inner, np.copysign(room * (1.0 - gain), own), out=clamped[part, axis])
    return clamped.transpose(2, 0, 1), gains.transpose(2, 0, 1)
