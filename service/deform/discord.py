"""How far groups of parts disagree on where a vertex goes."""

from __future__ import annotations

import numpy as np

from service.deform.groups import Group
from service.deform.proximity import Array, Array32
from service.template.affine import AffineTemplate

# A strong edit, as a share of each parameter.
EDIT = 0.4


def group_fields(
    template: AffineTemplate, shares: Array32, local: Array32, groups: list[Group]
) -> Array32:
    """Displacements per unit of each parameter as each group alone has them, ``[G, n, 3 d]``."""
    coefficients = np.concatenate([local, np.ones_like(local[:, :, :1])], axis=2)
    coefficients *= shares[:, :, None]
    moves = template.frame_jacobian.transpose(0, 2, 1, 3).astype(np.float32)
    moves = moves.reshape(len(moves), 4, -1)
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
