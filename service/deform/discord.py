"""How far groups of parts disagree on where a vertex goes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from service.deform.compilation import Field
from service.deform.proximity import Array, Array32

# A strong edit, as a share of each parameter.
EDIT = 0.4


def discord(fields: Sequence[Field], to_group: Array32, f: Array) -> Array32:
    """``[n, G]`` how far apart a strong edit moves a vertex by each group and by its nearest.

    Args:
        fields: of the groups.
        to_group: ``[n, G]`` distances to them.
        f: ``[d]`` parameters; 0 for those that aren't edited.
    """
    nearest = to_group.argmin(axis=1)
    is_nearest = [(nearest == g).astype(np.float32) for g in range(len(fields))]
    apart = np.zeros((len(fields), len(to_group)), np.float32)
    for index in sorted({index for field in fields for index in field}):
        edit = np.float32(EDIT * f[index % len(f)])
        if edit == 0.0:
            continue
        moved = [edit * field[index] if index in field else np.float32(0.0) for field in fields]
        own = sum(near * move for near, move in zip(is_nearest, moved, strict=True))
        for most, move in zip(apart, moved, strict=True):
            np.maximum(most, np.abs(move - own), out=most)
    return apart.T
