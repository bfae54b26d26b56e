"""How far groups of parts disagree on where a vertex goes."""

from __future__ import annotations

import numpy as np

from service.deform.compilation import carried, part_moves
from service.deform.groups import Group
from service.deform.proximity import Array, Array32
from service.template.affine import AffineTemplate

# A strong edit, as a share of each parameter.
EDIT = 0.4


def group_fields(
    template: AffineTemplate, shares: Array32, local: Array32, groups: list[Group]
) -> Array32:
    """Displacements per unit of each parameter as each group alone has them, ``[G, n, 3 d]``."""
    coefficients = carried(template, local)
    coefficients *= shares[:, :, None]
    moves = part_moves(template)
    fields = np.empty((len(groups), len(local), moves.shape[2]), np.float32)
    for g, group in enumerate(groups):
        members = list(group.members)
        by_member = coefficients[:, members].reshape(len(local), -1)
        fields[g] = by_member @ np.concatenate(moves[members])
    return fields


def discord(fields: Array32, to_group: Array32, f: Array) -> Array32:
    """``[n, G]`` how far apart a strong edit moves a vertex by each group and by its nearest."""
    edit = np.tile(EDIT * f, 3).astype(np.float32)
    nearest = fields[to_group.argmin(axis=1), np.arange(fields.shape[1])]
    return np.stack([(np.abs(field - nearest) * edit).max(axis=1) for field in fields], axis=1)
